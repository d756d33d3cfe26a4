#include <dlfcn.h>
#include <fmt/format.h>
#include <matio.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "data/arrays/child_process.hpp"
#include "data/arrays/mat.hpp"
#include "data/arrays/mat_check.hpp"
#include "data/little_endian.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr int kDeepest = 16;

/// The functions of libmatio. It is loaded by the child only: with HDF5 it brings thirty libraries
/// that no other work needs, and it may be absent.
class Matio {
 public:
  Matio() : library_(dlopen(TORSIO_MATIO_LIBRARY, RTLD_NOW | RTLD_LOCAL)) {
    if (library_ == nullptr) return;
    find("Mat_Open", open);
    find("Mat_Close", close);
    find("Mat_VarReadNextInfo", next_info);
    find("Mat_VarReadDataAll", read_data);
    find("Mat_VarFree", free);
    find("Mat_VarGetNumberOfFields", field_count);
    find("Mat_VarGetStructFieldnames", field_names);
    find("Mat_VarGetStructFieldByIndex", field);
  }

  [[nodiscard]] bool is_complete() const noexcept { return library_ != nullptr && !lacks_some_; }

  decltype(&Mat_Open) open = nullptr;
  decltype(&Mat_Close) close = nullptr;
  decltype(&Mat_VarReadNextInfo) next_info = nullptr;
  decltype(&Mat_VarReadDataAll) read_data = nullptr;
  decltype(&Mat_VarFree) free = nullptr;
  decltype(&Mat_VarGetNumberOfFields) field_count = nullptr;
  decltype(&Mat_VarGetStructFieldnames) field_names = nullptr;
  decltype(&Mat_VarGetStructFieldByIndex) field = nullptr;

 private:
  template <class Function>
  void find(const char* name, Function& function) noexcept {
    function = reinterpret_cast<Function>(dlsym(library_, name));
    lacks_some_ = lacks_some_ || function == nullptr;
  }

  void* library_;
  bool lacks_some_ = false;
};

bool is_opaque(const matvar_t& variable) {
  return variable.class_type == MAT_C_OPAQUE || variable.class_type == MAT_C_OBJECT ||
         variable.class_type == MAT_C_FUNCTION || variable.class_type == MAT_C_EMPTY;
}

/// Whether a variable or a part of one is wanted, contains what is, or has a unit.
bool is_wanted(std::string_view name, const std::vector<std::string>& wanted) {
  return wanted.empty() || split_channel_name(name) ||
         std::ranges::any_of(wanted, [&](std::string_view column) {
           return column.starts_with(name) &&
                  (column.size() == name.size() || column[name.size()] == '.' ||
                   column[name.size()] == '/');
         });
}

/// Collects the arrays of one file. What it meets came from the library, in a child process.
class Collector {
 public:
  Collector(const Matio& matio, const std::vector<std::string>& wanted)
      : matio_(matio), wanted_(wanted) {}

  void add(const matvar_t& variable, const std::string& name, int depth) {
    if (depth > kDeepest || !is_wanted(name, wanted_)) return;
    if (is_opaque(variable)) {
      opaque_.push_back(name);
      not_read_.push_back(name + " (an object of MATLAB)");
    } else if (variable.class_type == MAT_C_STRUCT) {
      add_struct(variable, name, depth);
    } else if (const std::string problem = problem_of(variable); !problem.empty()) {
      not_read_.push_back(fmt::format("{} ({})", name, problem));
    } else if (variable.data != nullptr) {
      add_numbers(variable, name);
    }
  }

  [[nodiscard]] const std::vector<NamedArray>& arrays() const noexcept { return arrays_; }
  [[nodiscard]] const std::vector<std::string>& not_read() const noexcept { return not_read_; }
  [[nodiscard]] std::string problem() const {
    if (values_ > kMaxArrayValues) return fmt::format("more than {} numbers", kMaxArrayValues);
    if (!opaque_.empty() && (!wanted_.empty() || arrays_.empty()))
      return fmt::format(
          "{} is an object of MATLAB (table, timetable, timeseries, string, ..), which no other "
          "program can read; in MATLAB: s = table2struct(t, 'ToScalar', true); save('run.mat', "
          "'-struct', 's'); for a timeseries ts: q = ts.Data; t_s = ts.Time",
          opaque_.front());
    return {};
  }

 private:
  void add_struct(const matvar_t& variable, const std::string& name, int depth) {
    // The library's functions take no const.
    auto* const structure = const_cast<matvar_t*>(&variable);
    const unsigned fields = matio_.field_count(structure);
    char* const* const names = matio_.field_names(structure);
    std::size_t elements = 1;
    for (int i = 0; i < variable.rank; ++i) elements *= variable.dims[i];
    constexpr std::size_t kMaxElements = 100;
    for (std::size_t element = 0; element < std::min(elements, kMaxElements); ++element) {
      const std::string prefix = elements == 1 ? name : fmt::format("{}/{}", name, element);
      for (unsigned field = 0; field < fields; ++field) {
        const matvar_t* const part = matio_.field(structure, field, element);
        if (part != nullptr && names != nullptr)
          add(*part, prefix + "." + escaped(names[field]), depth + 1);
      }
    }
  }

  [[nodiscard]] static std::optional<MatrixShape> shape_of(const matvar_t& variable) {
    return as_matrix({variable.dims, static_cast<std::size_t>(variable.rank)});
  }

  /// @returns why it is not read; empty if it is
  [[nodiscard]] static std::string problem_of(const matvar_t& variable) {
    if (variable.class_type == MAT_C_CELL) return "a cell array";
    if (variable.class_type == MAT_C_CHAR) return "a text";
    if (variable.class_type == MAT_C_SPARSE) return "a sparse matrix";
    if (variable.isComplex != 0) return "complex numbers";
    return problem_of_shape({variable.dims, static_cast<std::size_t>(variable.rank)});
  }

  template <class Number>
  void add_as(const matvar_t& variable, const std::string& name) {
    const MatrixShape shape = *shape_of(variable);
    const std::size_t rows = shape.rows;
    const std::size_t columns = shape.columns;
    if (rows == 0 || columns == 0 || variable.nbytes / sizeof(Number) / rows < columns) return;
    values_ += rows * columns;
    if (values_ > kMaxArrayValues) return;
    const auto* const values = static_cast<const char*>(variable.data);
    add_columns(arrays_, name, rows, columns, [&](std::size_t row, std::size_t column) {
      const std::size_t index = shape.is_turned ? row * columns + column : column * rows + row;
      Number value{};
      std::memcpy(&value, values + index * sizeof(Number), sizeof(Number));
      return static_cast<double>(value);
    });
  }

  void add_numbers(const matvar_t& variable, const std::string& name) {
    switch (variable.class_type) {
      case MAT_C_DOUBLE: return add_as<double>(variable, name);
      case MAT_C_SINGLE: return add_as<float>(variable, name);
      case MAT_C_INT8: return add_as<std::int8_t>(variable, name);
      case MAT_C_UINT8: return add_as<std::uint8_t>(variable, name);
      case MAT_C_INT16: return add_as<std::int16_t>(variable, name);
      case MAT_C_UINT16: return add_as<std::uint16_t>(variable, name);
      case MAT_C_INT32: return add_as<std::int32_t>(variable, name);
      case MAT_C_UINT32: return add_as<std::uint32_t>(variable, name);
      case MAT_C_INT64: return add_as<std::int64_t>(variable, name);
      case MAT_C_UINT64: return add_as<std::uint64_t>(variable, name);
      default: return;
    }
  }

  const Matio& matio_;
  const std::vector<std::string>& wanted_;
  std::vector<NamedArray> arrays_;
  std::vector<std::string> opaque_;
  std::vector<std::string> not_read_;
  std::size_t values_ = 0;
};

/// Writes name and values of an array. @returns false if the pipe is closed
bool send(int descriptor, const NamedArray& array) {
  std::string head;
  LittleEndianWriter(head)
      .text<std::uint64_t>(array.name)
      .number(static_cast<std::uint64_t>(array.values.size()));
  return write_all(descriptor, head.data(), head.size()) &&
         write_all(descriptor, array.values.data(), array.values.size() * sizeof(double));
}

constexpr std::uint64_t kNotRead = ~std::uint64_t{0};  ///< in the place of the length

bool send_not_read(int descriptor, const std::string& text) {
  std::string head;
  LittleEndianWriter(head).text<std::uint64_t>(text).number(kNotRead);
  return write_all(descriptor, head.data(), head.size());
}

/// The work of the child. @returns what went wrong
std::string send_arrays(const std::string& path, const std::vector<std::string>& wanted,
                        int descriptor) noexcept {
  try {
    const Matio matio;
    if (!matio.is_complete())
      return "MATLAB files are read by " TORSIO_MATIO_LIBRARY
             ", which is not installed (Debian: "
             "apt-get install libmatio11)";
    const std::unique_ptr<mat_t, decltype(matio.close)> file(
        matio.open(path.c_str(), MAT_ACC_RDONLY), matio.close);
    if (!file) return "it is not a MATLAB file, or is damaged";
    Collector collector(matio, wanted);
    std::size_t variables = 0;
    while (true) {
      const std::unique_ptr<matvar_t, decltype(matio.free)> variable(matio.next_info(file.get()),
                                                                     matio.free);
      if (!variable) break;
      ++variables;
      const std::string name = variable->name == nullptr ? "" : escaped(variable->name);
      if (!is_wanted(name, wanted)) continue;
      if (!is_opaque(*variable) && matio.read_data(file.get(), variable.get()) != 0)
        return fmt::format("the variable {} is damaged", name);
      collector.add(*variable, name, 0);
    }
    if (variables == 0) return "it has no variables, or is damaged";
    if (std::string problem = collector.problem(); !problem.empty()) return problem;
    for (const NamedArray& array : collector.arrays())
      if (!send(descriptor, array)) return "the result was not taken";
    for (const std::string& text : collector.not_read())
      if (!send_not_read(descriptor, text)) return "the result was not taken";
    return {};
  } catch (const std::exception& failed) {
    return std::string("it needs too much memory, or is damaged: ") + failed.what();
  }
}

}  // namespace

bool has_mat_library() { return Matio().is_complete(); }

ReadArrays read_mat(const std::string& path, const std::vector<std::string>& wanted,
                    const Progress& progress) {
  ReadBudget budget(path, progress);
  const auto file = placed_bytes_of(path);
  verify_mat(*file, budget);
  const auto megabytes = static_cast<unsigned>(file->size() >> 20U);
  const ChildLimits limits{.memory_bytes = budget.memory_limit(), .cpu_s = 4 + megabytes};
  const ChildOutput sent =
      output_of_child([&](int descriptor) { return send_arrays(path, wanted, descriptor); }, path,
                      progress, limits);
  LittleEndianReader reader(sent.bytes());
  ReadArrays result;
  while (reader.left() > 0) {
    const auto name = reader.text<std::uint64_t>();
    const auto count = reader.number<std::uint64_t>();
    if (name && count == kNotRead) {
      result.not_read.emplace_back(*name);
      continue;
    }
    const auto bytes = name && count && *count <= reader.left() / sizeof(double)
                           ? reader.bytes(static_cast<std::size_t>(*count) * sizeof(double))
                           : std::nullopt;
    if (!bytes) throw Error({.place = path, .problem = "the library that reads it failed"});
    NamedArray& array = result.arrays.emplace_back();
    array.name = *name;
    array.values.resize(static_cast<std::size_t>(*count));
    std::memcpy(array.values.data(), bytes->data(), bytes->size());
  }
  return result;
}

}  // namespace torsio
