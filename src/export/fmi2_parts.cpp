#include "export/fmi_variables.hpp"

namespace torsio {
namespace {

constexpr const char* kFmi2Types =
    R"c(typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef int fmi2Boolean;
typedef char fmi2Byte;
typedef struct {
  void (*logger)(void *environment, const char *instance, fmi2Status status, const char *category, const char *message,
                 ...);
  void *(*allocateMemory)(size_t count, size_t size);
  void (*freeMemory)(void *memory);
  void (*stepFinished)(void *environment, fmi2Status status);
  void *environment;
} fmi2CallbackFunctions;
)c";

constexpr const char* kFmi2Callbacks = R"c(
/* The text is a format for the logger: it has no % sign. */
static void @fmi_log(const @fmi_instance *it, const char *message) {
  if (it->call.logger != NULL)
    it->call.logger(it->call.environment, it->name, fmi2Error, @FMI_CATEGORY, message);
}

static void *@fmi_allocate(const @fmi_instance *it, size_t size) {
  return it->call.allocateMemory != NULL ? it->call.allocateMemory(1U, size) : calloc(1U, size);
}

static void @fmi_release(const @fmi_instance *it, void *memory) {
  void (*const release)(void *) = it->call.freeMemory;
  if (release != NULL) release(memory);
  else free(memory);
}
)c";

constexpr const char* kFmi2Functions = R"c(
@FMI_EXPORT const char *@FMI(fmi2GetTypesPlatform)(void) { return "default"; }
@FMI_EXPORT const char *@FMI(fmi2GetVersion)(void) { return "2.0"; }

@FMI_EXPORT void *@FMI(fmi2Instantiate)(const char *name, fmi2Type type, const char *guid, const char *resources,
                                        const fmi2CallbackFunctions *functions, fmi2Boolean is_visible,
                                        fmi2Boolean is_logging) {
  @fmi_instance *it;
  const char *why = NULL;
  if (functions == NULL) return NULL;
  if (type != fmi2CoSimulation) why = "this FMU is for co-simulation";
  else if (guid == NULL || strcmp(guid, @FMI_TOKEN) != 0) why = "the GUID is that of another FMU";
  else if (name == NULL || name[0] == '\0') why = "the instance has no name";
  else if (functions->allocateMemory != NULL && functions->freeMemory == NULL) why = "memory cannot be freed";
  if (why != NULL) {
    if (functions->logger != NULL)
      functions->logger(functions->environment, name != NULL ? name : "", fmi2Error, @FMI_CATEGORY, why);
    return NULL;
  }
  it = (@fmi_instance *)(functions->allocateMemory != NULL ? functions->allocateMemory(1U, sizeof *it + strlen(name) + 1U)
                                                           : calloc(1U, sizeof *it + strlen(name) + 1U));
  if (it == NULL) return NULL;
  it->call = *functions;
  if (it->call.allocateMemory == NULL) it->call.freeMemory = NULL;
  memcpy(it->name, name, strlen(name) + 1U);
  @fmi_restart(it);
  return it;
}

@FMI_EXPORT fmi2Status @FMI(fmi2SetupExperiment)(void *instance, fmi2Boolean has_tolerance, double tolerance, double start,
                                                 fmi2Boolean has_stop, double stop) {
  @fmi_instance *it = (@fmi_instance *)instance;
  if (!@fmi_is_allowed(it, @FMI_CREATED, "fmi2SetupExperiment")) return fmi2Error;
  if (!isfinite(start)) return @fmi_refuse(it, "fmi2SetupExperiment", "the start is not a time");
  it->now.time = start;
  it->now.has_time = 1;
  return fmi2OK;
}

@FMI_EXPORT fmi2Status @FMI(fmi2EnterInitializationMode)(void *instance) {
  @fmi_instance *it = (@fmi_instance *)instance;
  if (!@fmi_is_allowed(it, @FMI_CREATED, "fmi2EnterInitializationMode")) return fmi2Error;
  it->now.mode = @FMI_INITIALIZING;
  return fmi2OK;
}

@FMI_EXPORT fmi2Status @FMI(fmi2GetReal)(void *instance, const unsigned references[], size_t count, double values[]) {
  return @fmi_get((const @fmi_instance *)instance, "fmi2GetReal", references, count, values);
}

@FMI_EXPORT fmi2Status @FMI(fmi2SetReal)(void *instance, const unsigned references[], size_t count,
                                         const double values[]) {
  return @fmi_set((@fmi_instance *)instance, "fmi2SetReal", references, count, values);
}

@FMI_EXPORT fmi2Status @FMI(fmi2GetInteger)(void *instance, const unsigned references[], size_t count, int values[]) {
  const @fmi_instance *it = (const @fmi_instance *)instance;
  size_t i;
  if (!@fmi_is_fault(it, "fmi2GetInteger", references, count, values)) return fmi2Error;
  for (i = 0U; i < count; ++i) values[i] = it->now.fault;
  return fmi2OK;
}

@FMI_EXPORT fmi2Status @FMI(fmi2SetInteger)(void *instance, const unsigned references[], size_t count,
                                            const int values[]) {
  return @fmi_none((const @fmi_instance *)instance, "fmi2SetInteger", references, count);
}

@FMI_EXPORT fmi2Status @FMI(fmi2GetBoolean)(void *instance, const unsigned references[], size_t count,
                                            fmi2Boolean values[]) {
  return @fmi_none((const @fmi_instance *)instance, "fmi2GetBoolean", references, count);
}

@FMI_EXPORT fmi2Status @FMI(fmi2SetBoolean)(void *instance, const unsigned references[], size_t count,
                                            const fmi2Boolean values[]) {
  return @fmi_none((const @fmi_instance *)instance, "fmi2SetBoolean", references, count);
}

@FMI_EXPORT fmi2Status @FMI(fmi2GetString)(void *instance, const unsigned references[], size_t count,
                                           const char *values[]) {
  return @fmi_none((const @fmi_instance *)instance, "fmi2GetString", references, count);
}

@FMI_EXPORT fmi2Status @FMI(fmi2SetString)(void *instance, const unsigned references[], size_t count,
                                           const char *const values[]) {
  return @fmi_none((const @fmi_instance *)instance, "fmi2SetString", references, count);
}

@FMI_EXPORT fmi2Status @FMI(fmi2GetDirectionalDerivative)(void *instance, const unsigned unknowns[], size_t unknown_count,
                                                          const unsigned knowns[], size_t known_count,
                                                          const double known_changes[], double unknown_changes[]) {
  return @fmi_absent((const @fmi_instance *)instance, "fmi2GetDirectionalDerivative");
}

@FMI_EXPORT fmi2Status @FMI(fmi2SetRealInputDerivatives)(void *instance, const unsigned references[], size_t count,
                                                         const int orders[], const double values[]) {
  return @fmi_absent((const @fmi_instance *)instance, "fmi2SetRealInputDerivatives");
}

@FMI_EXPORT fmi2Status @FMI(fmi2GetRealOutputDerivatives)(void *instance, const unsigned references[], size_t count,
                                                          const int orders[], double values[]) {
  return @fmi_absent((const @fmi_instance *)instance, "fmi2GetRealOutputDerivatives");
}

@FMI_EXPORT fmi2Status @FMI(fmi2DoStep)(void *instance, double point, double size, fmi2Boolean is_final) {
  return @fmi_advance((@fmi_instance *)instance, "fmi2DoStep", point, size);
}

@FMI_EXPORT fmi2Status @FMI(fmi2CancelStep)(void *instance) {
  return @fmi_absent((const @fmi_instance *)instance, "fmi2CancelStep");
}

/* A step has ended when fmi2DoStep returns, so that there is little to ask. */
@FMI_EXPORT fmi2Status @FMI(fmi2GetStatus)(void *instance, fmi2StatusKind kind, fmi2Status *value) {
  return instance == NULL ? fmi2Error : fmi2Discard;
}

@FMI_EXPORT fmi2Status @FMI(fmi2GetRealStatus)(void *instance, fmi2StatusKind kind, double *value) {
  if (instance == NULL || value == NULL) return fmi2Error;
  if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
  *value = ((const @fmi_instance *)instance)->now.time;
  return fmi2OK;
}

@FMI_EXPORT fmi2Status @FMI(fmi2GetIntegerStatus)(void *instance, fmi2StatusKind kind, int *value) {
  return instance == NULL ? fmi2Error : fmi2Discard;
}

@FMI_EXPORT fmi2Status @FMI(fmi2GetBooleanStatus)(void *instance, fmi2StatusKind kind, fmi2Boolean *value) {
  if (instance == NULL || value == NULL) return fmi2Error;
  if (kind != fmi2Terminated) return fmi2Discard;
  *value = 0;
  return fmi2OK;
}

@FMI_EXPORT fmi2Status @FMI(fmi2GetStringStatus)(void *instance, fmi2StatusKind kind, const char **value) {
  return instance == NULL ? fmi2Error : fmi2Discard;
}
)c";

}  // namespace

FmiParts fmi2_parts() noexcept {
  return {.types = kFmi2Types,
          .members = "fmi2CallbackFunctions call;",
          .callbacks = kFmi2Callbacks,
          .functions = kFmi2Functions};
}

}  // namespace torsio
