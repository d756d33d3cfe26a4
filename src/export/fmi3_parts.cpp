#include "export/fmi_variables.hpp"

namespace torsio {
namespace {

constexpr const char* kFmi3Types = R"c(#include <stdbool.h>

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef bool fmi3Clock;
typedef void (*fmi3LogMessageCallback)(void *environment, fmi3Status status, fmi3String category, fmi3String message);
)c";

constexpr const char* kFmi3Callbacks = R"c(
static void @fmi_log(const @fmi_instance *it, const char *message) {
  if (it->log != NULL) it->log(it->environment, fmi3Error, @FMI_CATEGORY, message);
}

static void *@fmi_allocate(const @fmi_instance *it, size_t size) { return calloc(1U, size); }

static void @fmi_release(const @fmi_instance *it, void *memory) { free(memory); }
)c";

constexpr const char* kFmi3Functions = R"c(
@FMI_EXPORT const char *@FMI(fmi3GetVersion)(void) { return "3.0"; }

@FMI_EXPORT void *@FMI(fmi3InstantiateCoSimulation)(fmi3String name, fmi3String token, fmi3String resources,
                                                    fmi3Boolean is_visible, fmi3Boolean is_logging,
                                                    fmi3Boolean uses_events, fmi3Boolean may_return_early,
                                                    const unsigned intermediate[], size_t intermediate_count,
                                                    void *environment, fmi3LogMessageCallback log,
                                                    void (*update)(void *, fmi3Float64, fmi3Boolean, fmi3Boolean,
                                                                   fmi3Boolean, fmi3Boolean, fmi3Boolean *,
                                                                   fmi3Float64 *)) {
  @fmi_instance *it = NULL;
  const char *why = NULL;
  if (token == NULL || strcmp(token, @FMI_TOKEN) != 0) why = "the instantiation token is that of another FMU";
  else if (name == NULL || name[0] == '\0') why = "the instance has no name";
  else if (uses_events) why = "this FMU has no event mode";
  else if (intermediate_count != 0U) why = "this FMU has no intermediate updates";
  else it = (@fmi_instance *)calloc(1U, sizeof *it + strlen(name) + 1U);
  if (why != NULL && log != NULL) log(environment, fmi3Error, @FMI_CATEGORY, why);
  if (it == NULL) return NULL;
  it->environment = environment;
  it->log = log;
  memcpy(it->name, name, strlen(name) + 1U);
  @fmi_restart(it);
  return it;
}

@FMI_EXPORT void *@FMI(fmi3InstantiateModelExchange)(fmi3String name, fmi3String token, fmi3String resources,
                                                     fmi3Boolean is_visible, fmi3Boolean is_logging, void *environment,
                                                     fmi3LogMessageCallback log) {
  if (log != NULL) log(environment, fmi3Error, @FMI_CATEGORY, "this FMU is for co-simulation");
  return NULL;
}

@FMI_EXPORT void *@FMI(fmi3InstantiateScheduledExecution)(fmi3String name, fmi3String token, fmi3String resources,
                                                          fmi3Boolean is_visible, fmi3Boolean is_logging,
                                                          void *environment, fmi3LogMessageCallback log,
                                                          void (*update)(void *), void (*lock)(void),
                                                          void (*unlock)(void)) {
  if (log != NULL) log(environment, fmi3Error, @FMI_CATEGORY, "this FMU is for co-simulation");
  return NULL;
}

@FMI_EXPORT fmi3Status @FMI(fmi3EnterInitializationMode)(void *instance, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                                         fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop) {
  @fmi_instance *it = (@fmi_instance *)instance;
  if (!@fmi_is_allowed(it, @FMI_CREATED, "fmi3EnterInitializationMode")) return fmi3Error;
  if (!isfinite(start)) return @fmi_refuse(it, "fmi3EnterInitializationMode", "the start is not a time");
  it->now.time = start;
  it->now.has_time = 1;
  it->now.mode = @FMI_INITIALIZING;
  return fmi3OK;
}

@FMI_EXPORT fmi3Status @FMI(fmi3GetFloat64)(void *instance, const unsigned references[], size_t count,
                                            fmi3Float64 values[], size_t value_count) {
  const @fmi_instance *it = (const @fmi_instance *)instance;
  if (it != NULL && value_count != count) return @fmi_refuse(it, "fmi3GetFloat64", "all variables are scalars");
  return @fmi_get(it, "fmi3GetFloat64", references, count, values);
}

@FMI_EXPORT fmi3Status @FMI(fmi3SetFloat64)(void *instance, const unsigned references[], size_t count,
                                            const fmi3Float64 values[], size_t value_count) {
  @fmi_instance *it = (@fmi_instance *)instance;
  if (it != NULL && value_count != count) return @fmi_refuse(it, "fmi3SetFloat64", "all variables are scalars");
  return @fmi_set(it, "fmi3SetFloat64", references, count, values);
}

/* An enumeration is read as an Int64. */
@FMI_EXPORT fmi3Status @FMI(fmi3GetInt64)(void *instance, const unsigned references[], size_t count, fmi3Int64 values[],
                                          size_t value_count) {
  const @fmi_instance *it = (const @fmi_instance *)instance;
  size_t i;
  if (it != NULL && value_count != count) return @fmi_refuse(it, "fmi3GetInt64", "all variables are scalars");
  if (!@fmi_is_fault(it, "fmi3GetInt64", references, count, values)) return fmi3Error;
  for (i = 0U; i < count; ++i) values[i] = it->now.fault;
  return fmi3OK;
}

@FMI_EXPORT fmi3Status @FMI(fmi3DoStep)(void *instance, fmi3Float64 point, fmi3Float64 size, fmi3Boolean is_final,
                                        fmi3Boolean *has_event, fmi3Boolean *ends, fmi3Boolean *is_early,
                                        fmi3Float64 *last_time) {
  @fmi_instance *it = (@fmi_instance *)instance;
  const fmi3Status status = @fmi_advance(it, "fmi3DoStep", point, size);
  if (has_event != NULL) *has_event = false;
  if (ends != NULL) *ends = false;
  if (is_early != NULL) *is_early = false;
  if (it != NULL && last_time != NULL) *last_time = it->now.time;
  return status;
}

/* Types of which there are no variables. */
#define @FMI_NO_GETTER(type)                                                                                     \
  @FMI_EXPORT fmi3Status @FMI(fmi3Get##type)(void *instance, const unsigned references[], size_t count,          \
                                             fmi3##type values[], size_t value_count) {                          \
    return @fmi_none((const @fmi_instance *)instance, "fmi3Get" #type, references, count);                       \
  }
#define @FMI_NO_SETTER(type)                                                                                     \
  @FMI_EXPORT fmi3Status @FMI(fmi3Set##type)(void *instance, const unsigned references[], size_t count,          \
                                             const fmi3##type values[], size_t value_count) {                    \
    return @fmi_none((const @fmi_instance *)instance, "fmi3Set" #type, references, count);                       \
  }
@FMI_NO_GETTER(Float32)
@FMI_NO_GETTER(Int8)
@FMI_NO_GETTER(UInt8)
@FMI_NO_GETTER(Int16)
@FMI_NO_GETTER(UInt16)
@FMI_NO_GETTER(Int32)
@FMI_NO_GETTER(UInt32)
@FMI_NO_GETTER(UInt64)
@FMI_NO_GETTER(Boolean)
@FMI_NO_GETTER(String)
@FMI_NO_SETTER(Float32)
@FMI_NO_SETTER(Int8)
@FMI_NO_SETTER(UInt8)
@FMI_NO_SETTER(Int16)
@FMI_NO_SETTER(UInt16)
@FMI_NO_SETTER(Int32)
@FMI_NO_SETTER(UInt32)
@FMI_NO_SETTER(Int64)
@FMI_NO_SETTER(UInt64)
@FMI_NO_SETTER(Boolean)
@FMI_NO_SETTER(String)

/* Functions of which an FMU for co-simulation without events and derivatives has none; an importer may look for them. */
#define @FMI_ABSENT(name, parameters)                                    \
  @FMI_EXPORT fmi3Status @FMI(name) parameters {                         \
    return @fmi_absent((const @fmi_instance *)instance, #name);          \
  }
@FMI_ABSENT(fmi3GetBinary, (void *instance, const unsigned references[], size_t count, size_t sizes[],
                            fmi3Binary values[], size_t value_count))
@FMI_ABSENT(fmi3SetBinary, (void *instance, const unsigned references[], size_t count, const size_t sizes[],
                            const fmi3Binary values[], size_t value_count))
@FMI_ABSENT(fmi3GetClock, (void *instance, const unsigned references[], size_t count, fmi3Clock values[]))
@FMI_ABSENT(fmi3SetClock, (void *instance, const unsigned references[], size_t count, const fmi3Clock values[]))
@FMI_ABSENT(fmi3GetNumberOfVariableDependencies, (void *instance, unsigned reference, size_t *count))
@FMI_ABSENT(fmi3GetVariableDependencies, (void *instance, unsigned dependent, size_t dependent_elements[],
                                          unsigned independents[], size_t independent_elements[], int kinds[],
                                          size_t count))
@FMI_ABSENT(fmi3GetDirectionalDerivative, (void *instance, const unsigned unknowns[], size_t unknown_count,
                                           const unsigned knowns[], size_t known_count, const fmi3Float64 seed[],
                                           size_t seed_count, fmi3Float64 sensitivity[], size_t sensitivity_count))
@FMI_ABSENT(fmi3GetAdjointDerivative, (void *instance, const unsigned unknowns[], size_t unknown_count,
                                       const unsigned knowns[], size_t known_count, const fmi3Float64 seed[],
                                       size_t seed_count, fmi3Float64 sensitivity[], size_t sensitivity_count))
@FMI_ABSENT(fmi3EnterConfigurationMode, (void *instance))
@FMI_ABSENT(fmi3ExitConfigurationMode, (void *instance))
@FMI_ABSENT(fmi3EnterEventMode, (void *instance))
@FMI_ABSENT(fmi3EnterStepMode, (void *instance))
@FMI_ABSENT(fmi3GetIntervalDecimal, (void *instance, const unsigned references[], size_t count, fmi3Float64 intervals[],
                                     int qualifiers[]))
@FMI_ABSENT(fmi3GetIntervalFraction, (void *instance, const unsigned references[], size_t count, fmi3UInt64 counters[],
                                      fmi3UInt64 resolutions[], int qualifiers[]))
@FMI_ABSENT(fmi3GetShiftDecimal, (void *instance, const unsigned references[], size_t count, fmi3Float64 shifts[]))
@FMI_ABSENT(fmi3GetShiftFraction, (void *instance, const unsigned references[], size_t count, fmi3UInt64 counters[],
                                   fmi3UInt64 resolutions[]))
@FMI_ABSENT(fmi3SetIntervalDecimal, (void *instance, const unsigned references[], size_t count,
                                     const fmi3Float64 intervals[]))
@FMI_ABSENT(fmi3SetIntervalFraction, (void *instance, const unsigned references[], size_t count,
                                      const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))
@FMI_ABSENT(fmi3SetShiftDecimal, (void *instance, const unsigned references[], size_t count, const fmi3Float64 shifts[]))
@FMI_ABSENT(fmi3SetShiftFraction, (void *instance, const unsigned references[], size_t count,
                                   const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))
@FMI_ABSENT(fmi3EvaluateDiscreteStates, (void *instance))
@FMI_ABSENT(fmi3UpdateDiscreteStates, (void *instance, fmi3Boolean *needs_update, fmi3Boolean *ends,
                                       fmi3Boolean *nominals_changed, fmi3Boolean *states_changed,
                                       fmi3Boolean *has_next_event, fmi3Float64 *next_event))
@FMI_ABSENT(fmi3EnterContinuousTimeMode, (void *instance))
@FMI_ABSENT(fmi3CompletedIntegratorStep, (void *instance, fmi3Boolean is_final, fmi3Boolean *enters_events,
                                          fmi3Boolean *ends))
@FMI_ABSENT(fmi3SetTime, (void *instance, fmi3Float64 time))
@FMI_ABSENT(fmi3SetContinuousStates, (void *instance, const fmi3Float64 states[], size_t count))
@FMI_ABSENT(fmi3GetContinuousStateDerivatives, (void *instance, fmi3Float64 derivatives[], size_t count))
@FMI_ABSENT(fmi3GetEventIndicators, (void *instance, fmi3Float64 indicators[], size_t count))
@FMI_ABSENT(fmi3GetContinuousStates, (void *instance, fmi3Float64 states[], size_t count))
@FMI_ABSENT(fmi3GetNominalsOfContinuousStates, (void *instance, fmi3Float64 nominals[], size_t count))
@FMI_ABSENT(fmi3GetNumberOfEventIndicators, (void *instance, size_t *count))
@FMI_ABSENT(fmi3GetNumberOfContinuousStates, (void *instance, size_t *count))
@FMI_ABSENT(fmi3GetOutputDerivatives, (void *instance, const unsigned references[], size_t count,
                                       const fmi3Int32 orders[], fmi3Float64 values[], size_t value_count))
@FMI_ABSENT(fmi3ActivateModelPartition, (void *instance, unsigned reference, fmi3Float64 time))
)c";

}  // namespace

FmiParts fmi3_parts() noexcept {
  return {.types = kFmi3Types,
          .members = "void *environment;\n  fmi3LogMessageCallback log;",
          .callbacks = kFmi3Callbacks,
          .functions = kFmi3Functions};
}

}  // namespace torsio
