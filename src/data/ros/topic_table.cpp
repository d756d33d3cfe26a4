#include "data/ros/topic_table.hpp"

namespace torsio {

void TopicTable::replace_missing_stamps() {
  constexpr std::int64_t kSameClock_ns = 60'000'000'000;
  const auto first = std::ranges::find_if(stamps_ns_, [](auto stamp_ns) { return stamp_ns != 0; });
  const auto leading = static_cast<std::size_t>(first - stamps_ns_.begin());
  std::size_t row = 0;
  if (leading < rows()) {
    // Unsigned, since a file of unknown origin may have any stamps.
    const auto ahead_ns =
        static_cast<std::uint64_t>(*first) - static_cast<std::uint64_t>(log_times_ns_[leading]);
    if (ahead_ns + kSameClock_ns > 2 * kSameClock_ns) return;
    if (*first > 0 && *first < kSameClock_ns) row = leading;  // it begins at 0
  }
  for (; row < rows(); ++row)
    if (stamps_ns_[row] == 0) stamps_ns_[row] = log_times_ns_[row];
}

std::vector<TopicTable> TopicTable::parts(const std::vector<bool>& is_grouped, ReadBudget& budget) {
  using Layouts = std::vector<bool>;
  constexpr std::size_t kBits = 8;
  const std::size_t bytes = columns_.size() * (kColumnBytes + layouts_.size() / kBits);
  budget.require(bytes);
  std::vector<Layouts> has(columns_.size(), Layouts(layouts_.size(), false));
  for (std::size_t i = 0; i < layouts_.size(); ++i)
    for (const std::uint32_t column : layouts_[i]) has[column][i] = true;
  std::vector<Layouts> groups;
  for (std::size_t i = 0; i < columns_.size(); ++i)
    if (is_grouped[i] && std::ranges::find(groups, has[i]) == groups.end()) {
      budget.work(bytes);
      groups.push_back(has[i]);
    }
  std::vector<TopicTable> tables;
  if (groups.empty() ||
      (groups.size() == 1 && std::ranges::find(groups.front(), false) == groups.front().end())) {
    tables.push_back(std::move(*this));
    return tables;
  }
  for (const Layouts& group : groups) {
    budget.work(bytes);
    const auto is_in_all = [&](std::size_t column) {
      for (std::size_t i = 0; i < group.size(); ++i)
        if (group[i] && !has[column][i]) return false;
      return true;
    };
    std::vector<std::size_t> rows_of_part;
    for (std::size_t row = 0; row < rows(); ++row)
      if (group[layout_of_row_[row]]) rows_of_part.push_back(row);
    const auto picked = [&](const auto& all) {
      std::remove_cvref_t<decltype(all)> some;
      some.reserve(rows_of_part.size());
      for (const std::size_t row : rows_of_part) some.push_back(all[row]);
      return some;
    };
    TopicTable& part = tables.emplace_back();
    part.stamps_ns_ = picked(stamps_ns_);
    part.log_times_ns_ = picked(log_times_ns_);
    part.numbers_ = picked(numbers_);
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (is_grouped[i] ? has[i] != group : !is_in_all(i)) continue;
      budget.keep(kColumnBytes + sizeof(double) * rows_of_part.size());
      part.columns_.push_back({columns_[i].name, picked(columns_[i].values)});
    }
  }
  return tables;
}

}  // namespace torsio
