"""Draws curves as SVG."""


class Plot:
    """`x` and `y` take values to 0 to 1, from the left and from the bottom; size and margins (left, top, right, bottom) in px."""

    def __init__(self, size, margins, x, y):
        (self.width, self.height), (self.left, self.top, self.right, self.bottom) = size, margins
        self.x = lambda value: self.left + (self.width - self.left - self.right) * x(value)
        self.y = lambda value: self.height - self.bottom - (self.height - self.top - self.bottom) * y(value)
        self.svg = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{self.width}" height="{self.height}" font-family="sans-serif" font-size="12">',
                    f'<rect width="{self.width}" height="{self.height}" fill="white"/>']

    def text(self, x, y, text, anchor="start", more=""):
        self.svg.append(f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{more}>{text}</text>')

    def line(self, x1, x2, y, color, width=1):
        self.svg.append(f'<line x1="{x1}" x2="{x2}" y1="{y:.1f}" y2="{y:.1f}" stroke="{color}" stroke-width="{width}"/>')

    def axes(self, x_ticks, x_title, y_ticks, y_title):
        """Ticks are pairs of value and text."""
        for value, text in y_ticks:
            self.line(self.left, self.width - self.right, self.y(value), "#ddd")
            self.text(self.left - 8, self.y(value) + 4, text, "end")
        for value, text in x_ticks:
            self.text(self.x(value), self.height - self.bottom + 18, text, "middle")
        middle = (self.height - self.bottom + self.top) / 2
        self.text((self.left + self.width - self.right) / 2, self.height - 12, x_title, "middle")
        self.text(14, middle, y_title, "middle", f' transform="rotate(-90 14 {middle})"')

    def curve(self, points, color, dots=False):
        self.svg.append(f'<polyline fill="none" stroke="{color}" stroke-width="2" points="' + " ".join(f"{self.x(x):.1f},{self.y(y):.1f}" for x, y in points) + '"/>')
        if dots:
            self.svg += [f'<circle cx="{self.x(x):.1f}" cy="{self.y(y):.1f}" r="3" fill="{color}"/>' for x, y in points]

    def write(self, path):
        with open(path, "w") as f:
            f.write("\n".join([*self.svg, "</svg>"]) + "\n")
