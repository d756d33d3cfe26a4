#include <cstdio>

#include "torsio/train/families.hpp"

int main() {
  const torsio::FamilyInfo& family = torsio::find_family("dgmm");
  std::printf("%.*s\n", static_cast<int>(family.summary.size()), family.summary.data());
}
