#pragma once

#include <dlfcn.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "support/temporary_folder.hpp"
#include "torsio/export/fmu.hpp"

namespace torsio::test {

inline constexpr int kFmiOk = 0;
inline constexpr int kFmiDiscard = 2;
inline constexpr int kFmiError = 3;

/// The sources of an FMU, compiled with every warning as an error and loaded. The interface is declared a second time
/// here, from the standard and not from what torsio writes.
class FmuLibrary {
 public:
  FmuLibrary(const TemporaryFolder& folder, const Fmu& fmu, const std::string& flags = {})
      : fmu_(fmu) {
    std::string sources;
    for (const FmuFile& file : fmu.files) {
      if (!file.path.starts_with("sources/")) continue;
      const std::string path = folder.file(file.path.substr(8), file.bytes);
      if (path.ends_with(".c")) sources += " " + path;
    }
    path_ = folder.path(fmu.name + (fmu.version == FmiVersion::two ? "_2.so" : "_3.so"));
    const std::string command = fmt::format(
        "{} -std=c99 -O2 -pedantic -Wall -Wextra -Wconversion -Wdouble-promotion -Werror -fPIC "
        "-shared "
        "-fvisibility=hidden -ffp-contract=off {} {} -o {}",
        TORSIO_CC, flags, sources, path_);
    EXPECT_EQ(std::system(command.c_str()), 0)
        << command;  // NOLINT(concurrency-mt-unsafe,cert-env33-c)
    handle_ = dlopen(path_.c_str(), RTLD_NOW | RTLD_LOCAL);
    EXPECT_NE(handle_, nullptr) << dlerror();
  }
  ~FmuLibrary() {
    if (handle_ != nullptr) dlclose(handle_);
  }
  FmuLibrary(const FmuLibrary&) = delete;
  FmuLibrary& operator=(const FmuLibrary&) = delete;

  [[nodiscard]] const Fmu& fmu() const noexcept { return fmu_; }
  [[nodiscard]] bool is_two() const noexcept { return fmu_.version == FmiVersion::two; }
  [[nodiscard]] bool has(const std::string& name) const {
    return dlsym(handle_, name.c_str()) != nullptr;
  }
  /// A function by its name without "fmi2" or "fmi3".
  template <class... Arguments>
  int call(const std::string& name, Arguments... arguments) const {
    return function<int (*)(Arguments...)>(name)(arguments...);
  }
  template <class Function>
  [[nodiscard]] Function function(const std::string& name) const {
    const std::string whole = (is_two() ? "fmi2" : "fmi3") + name;
    void* const symbol = dlsym(handle_, whole.c_str());
    EXPECT_NE(symbol, nullptr) << whole;
    return reinterpret_cast<Function>(symbol);
  }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  Fmu fmu_;
  std::string path_;
  void* handle_ = nullptr;
};

using FmuLog = std::vector<std::string>;

inline void log_of_fmi2(void* environment, const char*, int, const char*, const char* message,
                        ...) {  // NOLINT(cert-dcl50-cpp): the standard's
  static_cast<FmuLog*>(environment)->emplace_back(message);
}
inline void log_of_fmi3(void* environment, int, const char*, const char* message) {
  static_cast<FmuLog*>(environment)->emplace_back(message);
}

/// The callbacks of FMI 2.
struct Fmi2Callbacks {
  void (*logger)(void*, const char*, int, const char*, const char*, ...) = log_of_fmi2;
  void* (*allocate)(std::size_t, std::size_t) = std::calloc;
  void (*release)(void*) = std::free;
  void (*step_finished)(void*, int) = nullptr;
  void* environment = nullptr;
};

/// @returns null if it is refused
inline void* instantiated(const FmuLibrary& library, const std::string& token, FmuLog& log) {
  if (library.is_two()) {
    const Fmi2Callbacks callbacks{.environment = &log};
    return library.function<void* (*)(const char*, int, const char*, const char*,
                                      const Fmi2Callbacks*, int, int)>("Instantiate")(
        "elbow", 1, token.c_str(), nullptr, &callbacks, 0, 1);
  }
  return library
      .function<void* (*)(const char*, const char*, const char*, bool, bool, bool, bool,
                          const unsigned*, std::size_t, void*, decltype(&log_of_fmi3), void*)>(
          "InstantiateCoSimulation")("elbow", token.c_str(), nullptr, false, true, false, false,
                                     nullptr, 0, &log, log_of_fmi3, nullptr);
}

/// One instance, with the calls that both versions have.
class FmuInstance {
 public:
  explicit FmuInstance(const FmuLibrary& library)
      : library_(library), it_(instantiated(library, library.fmu().token, log_)) {
    EXPECT_NE(it_, nullptr);
  }
  ~FmuInstance() { library_.function<void (*)(void*)>("FreeInstance")(it_); }
  FmuInstance(const FmuInstance&) = delete;
  FmuInstance& operator=(const FmuInstance&) = delete;

  int initialize(double start_s = 0.0) {
    if (library_.is_two()) {
      if (library_.call("SetupExperiment", it_, 0, 0.0, start_s, 0, 0.0) != kFmiOk)
        return kFmiError;
      if (library_.call("EnterInitializationMode", it_) != kFmiOk) return kFmiError;
    } else if (library_.call("EnterInitializationMode", it_, false, 0.0, start_s, false, 0.0) !=
               kFmiOk) {
      return kFmiError;
    }
    return library_.call("ExitInitializationMode", it_);
  }
  int set(unsigned reference, double value) {
    const unsigned* const references = &reference;
    const double* const values = &value;
    return library_.is_two() ? library_.call("SetReal", it_, references, std::size_t{1}, values)
                             : library_.call("SetFloat64", it_, references, std::size_t{1}, values,
                                             std::size_t{1});
  }
  int get(unsigned reference, double& value) {
    const unsigned* const references = &reference;
    double* const values = &value;
    return library_.is_two() ? library_.call("GetReal", it_, references, std::size_t{1}, values)
                             : library_.call("GetFloat64", it_, references, std::size_t{1}, values,
                                             std::size_t{1});
  }
  int fault(unsigned reference, int& value) {
    const unsigned* const references = &reference;
    if (library_.is_two())
      return library_.call("GetInteger", it_, references, std::size_t{1}, &value);
    std::int64_t wide = -1;
    const int status =
        library_.call("GetInt64", it_, references, std::size_t{1}, &wide, std::size_t{1});
    value = static_cast<int>(wide);
    return status;
  }
  int step(double point_s, double size_s) {
    if (library_.is_two()) return library_.call("DoStep", it_, point_s, size_s, 1);
    bool has_event = true;
    bool ends = true;
    bool is_early = true;
    double last_s = -1.0;
    const int status =
        library_.call("DoStep", it_, point_s, size_s, true, &has_event, &ends, &is_early, &last_s);
    EXPECT_FALSE(has_event || ends || is_early);
    return status;
  }
  int call(const std::string& name) { return library_.call(name, it_); }
  int get_state(void*& state) { return library_.call("Get" + state_name(), it_, &state); }
  int set_state(void* state) { return library_.call("Set" + state_name(), it_, state); }
  int free_state(void*& state) { return library_.call("Free" + state_name(), it_, &state); }
  std::vector<unsigned char> serialized(void* state) {
    std::size_t size = 0;
    EXPECT_EQ(library_.call("Serialized" + state_name() + "Size", it_, state, &size), kFmiOk);
    std::vector<unsigned char> bytes(size);
    EXPECT_EQ(library_.call("Serialize" + state_name(), it_, state, bytes.data(), bytes.size()),
              kFmiOk);
    return bytes;
  }
  int deserialize(const std::vector<unsigned char>& bytes, void*& state) {
    const unsigned char* const from = bytes.data();
    return library_.call(library_.is_two() ? "DeSerializeFMUstate" : "DeserializeFMUState", it_,
                         from, bytes.size(), &state);
  }
  /// The last message, which is removed with those before it.
  std::string message() {
    const std::string last = log_.empty() ? "" : log_.back();
    log_.clear();
    return last;
  }
  [[nodiscard]] void* address() const noexcept { return it_; }

 private:
  [[nodiscard]] std::string state_name() const {
    return library_.is_two() ? "FMUstate" : "FMUState";
  }

  const FmuLibrary& library_;
  FmuLog log_;
  void* it_;
};

}  // namespace torsio::test
