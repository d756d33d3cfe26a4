#include "design_flags.hpp"

void add_design_spring(CLI::App& /*design*/) {}
