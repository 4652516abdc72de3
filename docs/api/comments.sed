# The comments of the headers, made ones that Doxygen reads: those above a declaration, and those behind one.
s|^( *)//( .*)?$|\1///\2|
s|([^ /].*[;,{}]) +// |\1  ///< |
# What every reader of C++ knows of copies, moves and comparisons is not said.
/operator==\(const [A-Za-z]+&\) const = default;$/d
/ ([A-Za-z]+|operator=)\(([A-Za-z]+&&\) noexcept|const [A-Za-z]+&\));$/d
