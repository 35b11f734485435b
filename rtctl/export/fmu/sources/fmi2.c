/* FMI 2.0 for co-simulation. */
#include <stdlib.h>
#include <string.h>

#include <math.h>
#include "component.h"
#include "exported.h"
#include "fmi2_types.h"
#include "token.h" /* TOKEN, written for this plant */

typedef struct {
    component c;
    const fmi2CallbackFunctions *callbacks;
    char name[128];
    double last_time;
} instance;

static fmi2Status told(instance *i, const char *wrong)
{
    if (!wrong) return fmi2OK;
    if (i->callbacks && i->callbacks->logger) {
        i->callbacks->logger(i->callbacks->componentEnvironment, i->name, fmi2Error, "logStatusError", "%s", wrong);
    }
    return fmi2Error;
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
    (void)c; (void)on; (void)n; (void)categories; /* errors alone are told, always */
    return fmi2OK;
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
    instance *i = calloc(1, sizeof *i);
    (void)resources; (void)visible; (void)logging;
    if (!i) return 0;
    i->callbacks = callbacks;
    strncpy(i->name, name ? name : "", sizeof i->name - 1);
    const char *wrong = type != fmi2CoSimulation ? "this FMU is for co-simulation alone"
                        : !guid || strcmp(guid, TOKEN) ? "the GUID is not that of this FMU's description" : 0;
    if (wrong) {
        told(i, wrong);
        free(i);
        return 0;
    }
    component_reset(&i->c);
    return i;
}

EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                                      fmi2Boolean has_stop, fmi2Real stop)
{
    instance *i = c;
    (void)has_tolerance; (void)tolerance; (void)has_stop; (void)stop;
    i->c.s.origin = i->last_time = start;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    instance *i = c;
    return told(i, component_initialize(&i->c, i->c.s.origin));
}

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    instance *i = c;
    return told(i, component_begin(&i->c));
}

EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    component_reset(&((instance *)c)->c);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    instance *i = c;
    return told(i, component_get(&i->c, vr, n, value));
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    instance *i = c;
    return told(i, component_set(&i->c, vr, n, value));
}

#define NO_VARIABLES(type) \
    EXPORT fmi2Status fmi2Get##type(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2##type value[]) \
    { \
        (void)vr; (void)value; \
        return n ? told(c, "this FMU has real variables alone") : fmi2OK; \
    } \
    EXPORT fmi2Status fmi2Set##type(fmi2Component c, const fmi2ValueReference vr[], size_t n, \
                                    const fmi2##type value[]) \
    { \
        (void)vr; (void)value; \
        return n ? told(c, "this FMU has real variables alone") : fmi2OK; \
    }

NO_VARIABLES(Integer)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    instance *i = c;
    return told(i, component_copy(&i->c, state));
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    instance *i = c;
    return told(i, component_restore(&i->c, state));
}

EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    component_free_copy(state);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c; (void)state;
    *size = COPY_BYTES;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    return told(c, component_serialize(state, bytes, size));
}

EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    return told(c, component_deserialize(state, bytes, size));
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns,
                                               const fmi2ValueReference known[], size_t knowns,
                                               const fmi2Real seed[], fmi2Real derivative[])
{
    (void)unknown; (void)unknowns; (void)known; (void)knowns; (void)seed; (void)derivative;
    return told(c, "this FMU has no directional derivatives");
}

EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                              const fmi2Integer order[], const fmi2Real value[])
{
    instance *i = c;
    for (size_t k = 0; k < n; k++) {
        if (order[k] != 1) return told(i, "inputs have first derivatives alone");
        if (vr[k] < FIRST_INPUT || vr[k] >= FIRST_INPUT + PLANT_INPUTS) {
            return told(i, "a derivative was given of a variable that is no input");
        }
        if (!(fabs(value[k]) < 1e300)) return told(i, "a derivative must be a finite number");
        i->c.s.m.slope[vr[k] - FIRST_INPUT] = value[k];
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                               const fmi2Integer order[], fmi2Real value[])
{
    (void)vr; (void)order; (void)value;
    return n ? told(c, "outputs have no derivatives") : fmi2OK;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real now, fmi2Real h, fmi2Boolean no_way_back)
{
    instance *i = c;
    (void)no_way_back;
    const char *wrong = component_step(&i->c, now, h);
    if (!wrong) i->last_time = now + h;
    return told(i, wrong);
}

EXPORT fmi2Status fmi2CancelStep(fmi2Component c) { return told(c, "steps are done at once, none can be cancelled"); }

#define NO_STATUS(type) \
    EXPORT fmi2Status fmi2Get##type##Status(fmi2Component c, const fmi2StatusKind kind, fmi2##type *value) \
    { \
        (void)kind; (void)value; \
        return told(c, "there is no such status: steps are done at once"); \
    }

NO_STATUS(Integer)
NO_STATUS(Boolean)
NO_STATUS(String)

EXPORT fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)kind; (void)value;
    return told(c, "there is no such status: steps are done at once");
}

EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    if (kind != fmi2LastSuccessfulTime) return told(c, "there is no such status: steps are done at once");
    *value = ((instance *)c)->last_time;
    return fmi2OK;
}
