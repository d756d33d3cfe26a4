#include "design_flags.hpp"

void add_design_actuator(CLI::App& /*design*/) {}
