// The C file that makes a program of `c99_program` an FMU. Types and functions are those of the standard, FMI 2.0 and
// FMI 3.0; the declarations are torsio's own.

#include <fmt/format.h>

#include <string>

#include "export/c_text.hpp"
#include "export/fmi_variables.hpp"

namespace torsio {
namespace {

constexpr const char* kFmiHead =
    R"c(/* $NAME$_fmi.c: $NAME$.h as an FMU for co-simulation, FMI $VERSION$. */
#include "$NAME$.h"

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The standard fixes the parameters, also those that are not used here. */
#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

/* Several FMUs in one program have a prefix each; a shared library has none. */
#ifdef FMI$F$_FUNCTION_PREFIX
#define @FMI_PASTE_NOW(prefix, name) prefix##name
#define @FMI_PASTE(prefix, name) @FMI_PASTE_NOW(prefix, name)
#define @FMI(name) @FMI_PASTE(FMI$F$_FUNCTION_PREFIX, name)
#define @FMI_EXPORT
#else
#define @FMI(name) name
#if defined _WIN32 || defined __CYGWIN__
#define @FMI_EXPORT __declspec(dllexport)
#elif defined __GNUC__
#define @FMI_EXPORT __attribute__((visibility("default")))
#else
#define @FMI_EXPORT
#endif
#endif

$TYPES$
#define @FMI_TOKEN "$TOKEN$"
#define @FMI_PERIOD $PERIOD$ /* of a tick, in s */
#define @FMI_CATEGORY "logStatusError"

/* Value references. */
#define @FMI_TIME 0U
#define @FMI_FIRST_INPUT 1U
#define @FMI_INPUTS $INPUT_COUNT$U
$ZERO_REFERENCES$#define @FMI_VALUE $VALUE$U
#define @FMI_STD_DEV $STD_DEV$U
#define @FMI_FAULT $FAULT$U

/* Modes, a bit each. */
enum { @FMI_CREATED = 1, @FMI_INITIALIZING = 2, @FMI_STEPPING = 4, @FMI_TERMINATED = 8 };

/* All that changes: a copy of it is the state of the FMU. */
typedef struct {
  @state joint;
  double inputs[@FMI_INPUTS];
$ZERO_MEMBER$  double value, std_dev, time;
  int fault, mode, has_time;
} @fmi_values;

typedef struct {
  @fmi_values now;
  $LOGGER$
  char name[];
} @fmi_instance;
)c";

constexpr const char* kFmiValues = R"c(
static fmi$F$Status @fmi_refuse(const @fmi_instance *it, const char *function, const char *why) {
  char text[256];
  (void)snprintf(text, sizeof text, "%s: %s", function, why);
  if (it != NULL) @fmi_log(it, text);
  return fmi$F$Error;
}

static int @fmi_is_allowed(const @fmi_instance *it, int modes, const char *function) {
  if (it == NULL) return 0;
  if ((it->now.mode & modes) != 0) return 1;
  (void)@fmi_refuse(it, function,
                    it->now.mode == @FMI_CREATED        ? "not allowed before the initialization"
                    : it->now.mode == @FMI_INITIALIZING ? "not allowed during the initialization"
                    : it->now.mode == @FMI_STEPPING     ? "not allowed after the initialization"
                                                        : "not allowed after the end");
  return 0;
}

static void @fmi_restart(@fmi_instance *it) {
  memset(&it->now, 0, sizeof it->now);
  it->now.std_dev = (double)NAN;
  it->now.fault = @WARMING_UP;
  it->now.mode = @FMI_CREATED;
$ZERO_STARTS$}

static int @fmi_read(const @fmi_instance *it, unsigned reference, double *value) {
  if (reference == @FMI_TIME) *value = it->now.time;
  else if (reference - @FMI_FIRST_INPUT < @FMI_INPUTS) *value = it->now.inputs[reference - @FMI_FIRST_INPUT];
$ZERO_READ$  else if (reference == @FMI_VALUE) *value = it->now.value;
  else if (reference == @FMI_STD_DEV) *value = it->now.std_dev;
  else return 0;
  return 1;
}

static fmi$F$Status @fmi_refuse_reference(const @fmi_instance *it, const char *function, unsigned reference) {
  char why[96];
  (void)snprintf(why, sizeof why, "no such variable has the value reference %u", reference);
  return @fmi_refuse(it, function, why);
}

static fmi$F$Status @fmi_get(const @fmi_instance *it, const char *function, const unsigned references[], size_t count,
                             double values[]) {
  size_t i;
  if (!@fmi_is_allowed(it, ~0, function)) return fmi$F$Error;
  if (count != 0U && (references == NULL || values == NULL)) return @fmi_refuse(it, function, "no place for the values");
  for (i = 0U; i < count; ++i)
    if (!@fmi_read(it, references[i], &values[i])) return @fmi_refuse_reference(it, function, references[i]);
  return fmi$F$OK;
}
$ZERO_FUNCTION$
/* All of them, or none. */
static fmi$F$Status @fmi_set(@fmi_instance *it, const char *function, const unsigned references[], size_t count,
                             const double values[]) {
  size_t i;
  if (!@fmi_is_allowed(it, @FMI_CREATED | @FMI_INITIALIZING | @FMI_STEPPING, function)) return fmi$F$Error;
  if (count != 0U && (references == NULL || values == NULL)) return @fmi_refuse(it, function, "no values");
  for (i = 0U; i < count; ++i) {
    if (references[i] - @FMI_FIRST_INPUT < @FMI_INPUTS) continue;
$ZERO_CHECK$    return @fmi_refuse_reference(it, function, references[i]);
  }
  for (i = 0U; i < count; ++i) {
    if (references[i] - @FMI_FIRST_INPUT < @FMI_INPUTS) it->now.inputs[references[i] - @FMI_FIRST_INPUT] = values[i];
$ZERO_SET$  }
  return fmi$F$OK;
}

/* The fault, which is the only whole number. */
static int @fmi_is_fault(const @fmi_instance *it, const char *function, const unsigned references[], size_t count,
                         const void *values) {
  size_t i;
  if (!@fmi_is_allowed(it, ~0, function)) return 0;
  if (count != 0U && (references == NULL || values == NULL)) {
    (void)@fmi_refuse(it, function, "no place for the values");
    return 0;
  }
  for (i = 0U; i < count; ++i)
    if (references[i] != @FMI_FAULT) {
      (void)@fmi_refuse_reference(it, function, references[i]);
      return 0;
    }
  return 1;
}

/* For types of which there are no variables. */
static fmi$F$Status @fmi_none(const @fmi_instance *it, const char *function, const unsigned references[], size_t count) {
  if (!@fmi_is_allowed(it, ~0, function)) return fmi$F$Error;
  if (count == 0U) return fmi$F$OK;
  return references == NULL ? @fmi_refuse(it, function, "no value references")
                            : @fmi_refuse_reference(it, function, references[0]);
}

static fmi$F$Status @fmi_absent(const @fmi_instance *it, const char *function) {
  return @fmi_refuse(it, function, "this FMU does not have it");
}

static fmi$F$Status @fmi_advance(@fmi_instance *it, const char *function, double point, double size) {
  const double ticks = size / @FMI_PERIOD;
  char why[128];
  uint32_t count;
  uint32_t i;
  if (!@fmi_is_allowed(it, @FMI_STEPPING, function)) return fmi$F$Error;
  /* Steps of an importer are differences of times: a ten-thousandth of a tick is rounding. */
  count = ticks > 0.5 && ticks < 1e9 ? (uint32_t)(ticks + 0.5) : 0U;
  if (count == 0U || !(fabs(ticks - (double)count) < 1e-4)) {
    (void)snprintf(why, sizeof why, "a communication step of %.9g s: only whole multiples of %.9g s are possible", size,
                   @FMI_PERIOD);
    return @fmi_refuse(it, function, why);
  }
  if (!(fabs(point) < 1e15) || (it->now.has_time && !(fabs(point - it->now.time) < 0.01 * @FMI_PERIOD))) {
    (void)snprintf(why, sizeof why, "the step begins at %.9g s, but the last one ended at %.9g s", point, it->now.time);
    return @fmi_refuse(it, function, why);
  }
  for (i = 0U; i < count; ++i) {
    const @estimate estimate = @step(&it->now.joint$ARGUMENTS$);
    it->now.value = (double)estimate.value;
    it->now.std_dev = (double)estimate.std_dev;
    it->now.fault = estimate.fault;
  }
  it->now.time = point + size;
  it->now.has_time = 1;
  return fmi$F$OK;
}

/* FNV-1a. */
static uint32_t @fmi_checksum(const unsigned char *bytes, size_t count) {
  uint32_t sum = 2166136261U;
  size_t i;
  for (i = 0U; i < count; ++i) sum = (sum ^ bytes[i]) * 16777619U;
  return sum;
}
)c";

constexpr const char* kFmiShared = R"c(
@FMI_EXPORT fmi$F$Status @FMI(fmi$F$SetDebugLogging)(void *instance, fmi$F$Boolean is_on, size_t count,
                                                     const char *const categories[]) {
  const @fmi_instance *it = (const @fmi_instance *)instance;
  size_t i;
  if (!@fmi_is_allowed(it, ~0, "fmi$F$SetDebugLogging")) return fmi$F$Error;
  if (count != 0U && categories == NULL) return @fmi_refuse(it, "fmi$F$SetDebugLogging", "no categories");
  for (i = 0U; i < count; ++i)
    if (categories[i] == NULL || strcmp(categories[i], @FMI_CATEGORY) != 0)
      return @fmi_refuse(it, "fmi$F$SetDebugLogging", "the only category is " @FMI_CATEGORY);
  return fmi$F$OK;
}

@FMI_EXPORT void @FMI(fmi$F$FreeInstance)(void *instance) {
  if (instance != NULL) @fmi_release((const @fmi_instance *)instance, instance);
}

@FMI_EXPORT fmi$F$Status @FMI(fmi$F$ExitInitializationMode)(void *instance) {
  @fmi_instance *it = (@fmi_instance *)instance;
  if (!@fmi_is_allowed(it, @FMI_INITIALIZING, "fmi$F$ExitInitializationMode")) return fmi$F$Error;
  it->now.mode = @FMI_STEPPING;
  return fmi$F$OK;
}

@FMI_EXPORT fmi$F$Status @FMI(fmi$F$Terminate)(void *instance) {
  @fmi_instance *it = (@fmi_instance *)instance;
  if (!@fmi_is_allowed(it, @FMI_STEPPING, "fmi$F$Terminate")) return fmi$F$Error;
  it->now.mode = @FMI_TERMINATED;
  return fmi$F$OK;
}

@FMI_EXPORT fmi$F$Status @FMI(fmi$F$Reset)(void *instance) {
  if (instance == NULL) return fmi$F$Error;
  @fmi_restart((@fmi_instance *)instance);
  return fmi$F$OK;
}

@FMI_EXPORT fmi$F$Status @FMI(fmi$F$Get$STATE$)(void *instance, void **state) {
  const @fmi_instance *it = (const @fmi_instance *)instance;
  if (it == NULL || state == NULL) return @fmi_refuse(it, "fmi$F$Get$STATE$", "no place for the state");
  if (*state == NULL) *state = @fmi_allocate(it, sizeof it->now);
  if (*state == NULL) return @fmi_refuse(it, "fmi$F$Get$STATE$", "no memory");
  memcpy(*state, &it->now, sizeof it->now);
  return fmi$F$OK;
}

@FMI_EXPORT fmi$F$Status @FMI(fmi$F$Set$STATE$)(void *instance, void *state) {
  @fmi_instance *it = (@fmi_instance *)instance;
  if (it == NULL || state == NULL) return @fmi_refuse(it, "fmi$F$Set$STATE$", "no state");
  memcpy(&it->now, state, sizeof it->now);
  return fmi$F$OK;
}

@FMI_EXPORT fmi$F$Status @FMI(fmi$F$Free$STATE$)(void *instance, void **state) {
  const @fmi_instance *it = (const @fmi_instance *)instance;
  if (it == NULL) return fmi$F$Error;
  if (state == NULL || *state == NULL) return fmi$F$OK;
  @fmi_release(it, *state);
  *state = NULL;
  return fmi$F$OK;
}

/* The bytes of a state are the token, a checksum, and the memory of the state, for the same library alone. */
#define @FMI_SERIALIZED_HEAD (sizeof @FMI_TOKEN + sizeof(uint32_t))
#define @FMI_SERIALIZED (@FMI_SERIALIZED_HEAD + sizeof(@fmi_values))

@FMI_EXPORT fmi$F$Status @FMI(fmi$F$Serialized$STATE$Size)(void *instance, void *state, size_t *size) {
  const @fmi_instance *it = (const @fmi_instance *)instance;
  if (it == NULL || state == NULL || size == NULL) return @fmi_refuse(it, "fmi$F$Serialized$STATE$Size", "no state");
  *size = @FMI_SERIALIZED;
  return fmi$F$OK;
}

@FMI_EXPORT fmi$F$Status @FMI(fmi$F$Serialize$STATE$)(void *instance, void *state, fmi$F$Byte bytes[], size_t size) {
  const @fmi_instance *it = (const @fmi_instance *)instance;
  unsigned char *to = (unsigned char *)bytes;
  uint32_t sum;
  if (it == NULL || state == NULL || bytes == NULL || size < @FMI_SERIALIZED)
    return @fmi_refuse(it, "fmi$F$Serialize$STATE$", "no state, or too little memory");
  sum = @fmi_checksum((const unsigned char *)state, sizeof(@fmi_values));
  memcpy(to, @FMI_TOKEN, sizeof @FMI_TOKEN);
  memcpy(to + sizeof @FMI_TOKEN, &sum, sizeof sum);
  memcpy(to + @FMI_SERIALIZED_HEAD, state, sizeof(@fmi_values));
  return fmi$F$OK;
}

@FMI_EXPORT fmi$F$Status @FMI(fmi$F$$DESERIALIZE$)(void *instance, const fmi$F$Byte bytes[], size_t size, void **state) {
  const @fmi_instance *it = (const @fmi_instance *)instance;
  const unsigned char *from = (const unsigned char *)bytes;
  uint32_t sum;
  if (it == NULL || state == NULL || bytes == NULL || size < @FMI_SERIALIZED ||
      memcmp(from, @FMI_TOKEN, sizeof @FMI_TOKEN) != 0)
    return @fmi_refuse(it, "fmi$F$$DESERIALIZE$", "not a state of this FMU");
  memcpy(&sum, from + sizeof @FMI_TOKEN, sizeof sum);
  if (sum != @fmi_checksum(from + @FMI_SERIALIZED_HEAD, sizeof(@fmi_values)))
    return @fmi_refuse(it, "fmi$F$$DESERIALIZE$", "the state is damaged");
  if (*state == NULL) *state = @fmi_allocate(it, sizeof(@fmi_values));
  if (*state == NULL) return @fmi_refuse(it, "fmi$F$$DESERIALIZE$", "no memory");
  memcpy(*state, from + @FMI_SERIALIZED_HEAD, sizeof(@fmi_values));
  return fmi$F$OK;
}
)c";

/// What a model with zeros has in addition.
struct FmiZeroTexts {
  std::string references, member, starts, read, function, check, set;
};

FmiZeroTexts zero_texts(const FmiVariables& variables) {
  if (variables.zeros.empty()) return {};
  std::string cases;
  std::string starts;
  for (std::size_t i = 0; i < variables.zeros.size(); ++i) {
    const std::string& channel = variables.zeros[i];
    starts += fmt::format("  @set_zero_{}(&it->now.joint, (@real)0);\n", channel);
    cases += fmt::format(
        "  if (index == {}U) @set_zero_{}(&it->now.joint, (@real)it->now.zeros[index]);\n", i,
        channel);
  }
  return {.references = fmt::format("#define @FMI_FIRST_ZERO {}U\n#define @FMI_ZEROS {}U\n",
                                    variables.first_zero(), variables.zeros.size()),
          .member = "  double zeros[@FMI_ZEROS];\n",
          .starts = starts,
          .read =
              "  else if (reference - @FMI_FIRST_ZERO < @FMI_ZEROS) *value = "
              "it->now.zeros[reference - @FMI_FIRST_ZERO];\n",
          .function = fmt::format("\nstatic void @fmi_set_zero(@fmi_instance *it, unsigned index, "
                                  "double zero) {{\n  it->now.zeros[index] = zero;\n{}}}\n",
                                  cases),
          .check =
              "    if (references[i] - @FMI_FIRST_ZERO < @FMI_ZEROS && isfinite(values[i])) "
              "continue;\n"
              "    if (references[i] - @FMI_FIRST_ZERO < @FMI_ZEROS)\n"
              "      return @fmi_refuse(it, function, \"a zero must be finite\");\n",
          .set = "    else @fmi_set_zero(it, references[i] - @FMI_FIRST_ZERO, values[i]);\n"};
}

}  // namespace

std::string fmi_wrapper(const FmuOptions& options, const FmiVariables& variables,
                        const std::string& token) {
  const bool is_two = options.version == FmiVersion::two;
  const CText c(options.name, CReal::twofold);
  std::string arguments;
  for (std::size_t i = 0; i < variables.inputs.size(); ++i)
    arguments +=
        fmt::format(",\n                                     (@real)it->now.inputs[{}]", i);
  const FmiZeroTexts zeros = zero_texts(variables);
  const FmiParts parts = is_two ? fmi2_parts() : fmi3_parts();
  return c.filled(
      std::string(kFmiHead) + parts.callbacks + kFmiValues + kFmiShared + parts.functions,
      {{"TYPES", parts.types},
       {"LOGGER", parts.members},
       {"STATE", is_two ? "FMUstate" : "FMUState"},
       {"DESERIALIZE", is_two ? "DeSerializeFMUstate" : "DeserializeFMUState"},
       {"ARGUMENTS", arguments},
       {"INPUT_COUNT", fmt::format("{}", variables.inputs.size())},
       {"VALUE", fmt::format("{}", variables.value())},
       {"STD_DEV", fmt::format("{}", variables.std_dev())},
       {"FAULT", fmt::format("{}", variables.fault())},
       {"ZERO_REFERENCES", zeros.references},
       {"ZERO_MEMBER", zeros.member},
       {"ZERO_STARTS", zeros.starts},
       {"ZERO_READ", zeros.read},
       {"ZERO_FUNCTION", zeros.function},
       {"ZERO_CHECK", zeros.check},
       {"ZERO_SET", zeros.set},
       {"PERIOD", c.number(variables.period_s)},
       {"TOKEN", token},
       {"NAME", options.name},
       {"VERSION", is_two ? "2.0" : "3.0"},
       {"F", is_two ? "2" : "3"}});
}

}  // namespace torsio
