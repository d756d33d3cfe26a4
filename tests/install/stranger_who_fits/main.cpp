#include <cstdio>

#include "torsio/fit/families.hpp"

int main() {
  for (const torsio::FamilyInfo& family : torsio::families())
    std::printf("%.*s\n", static_cast<int>(family.name.size()), family.name.data());
}
