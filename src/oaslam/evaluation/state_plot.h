#pragma once

#include <string>
#include <vector>

namespace oaslam {

// The state of each frame of a run, from the columns of its frames.csv.
struct StateRow {
  std::string name;
  std::vector<double> timestamps;
  std::vector<std::string> states;  // "filled" where the pose was found later
};

// Throws InputError.
StateRow LoadStates(const std::string& frames_csv);

// A band for each run, coloured by state over time, with the share of frames in each.
void SaveStatePlot(const std::string& path, const std::vector<StateRow>& rows,
                   const std::string& title);

}  // namespace oaslam
