/* FMI 3.0 for co-simulation; what it has no use for stands in fmi3_unused.c. */
#include "fmi3_instance.h"

#include <stdlib.h>
#include <string.h>

#include "token.h" /* TOKEN, written for this plant */

fmi3Status told(instance *i, const char *wrong)
{
    if (!wrong) return fmi3OK;
    if (i->log) i->log(i->environment, fmi3Error, "logStatusError", wrong);
    return fmi3Error;
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[])
{
    (void)c; (void)on; (void)n; (void)categories; /* errors alone are told, always */
    return fmi3OK;
}

EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t intermediates,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    instance *i = calloc(1, sizeof *i);
    (void)name; (void)resources; (void)visible; (void)logging; (void)early_return; (void)intermediate;
    (void)intermediates; (void)update;
    if (!i) return 0;
    i->environment = environment;
    i->log = log;
    const char *wrong = event_mode ? "this FMU has no event mode"
                        : !token || strcmp(token, TOKEN) ? "the token is not that of this FMU's description" : 0;
    if (wrong) {
        told(i, wrong);
        free(i);
        return 0;
    }
    component_reset(&i->c);
    return i;
}

EXPORT void fmi3FreeInstance(fmi3Instance c) { free(c); }

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                              fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop)
{
    instance *i = c;
    (void)has_tolerance; (void)tolerance; (void)has_stop; (void)stop;
    return told(i, component_initialize(&i->c, start));
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    instance *i = c;
    return told(i, component_begin(&i->c));
}

EXPORT fmi3Status fmi3Terminate(fmi3Instance c)
{
    (void)c;
    return fmi3OK;
}

EXPORT fmi3Status fmi3Reset(fmi3Instance c)
{
    component_reset(&((instance *)c)->c);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[],
                                 size_t count)
{
    instance *i = c;
    if (n != count) return told(i, "all variables are scalars: as many values are needed as references");
    return told(i, component_get(&i->c, vr, n, values));
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[],
                                 size_t count)
{
    instance *i = c;
    if (n != count) return told(i, "all variables are scalars: as many values are needed as references");
    return told(i, component_set(&i->c, vr, n, values));
}

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state)
{
    instance *i = c;
    return told(i, component_copy(&i->c, state));
}

EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state)
{
    instance *i = c;
    return told(i, component_restore(&i->c, state));
}

EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    (void)c;
    component_free_copy(state);
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    (void)c; (void)state;
    *size = COPY_BYTES;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    return told(c, component_serialize(state, bytes, size));
}

EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    return told(c, component_deserialize(state, bytes, size));
}

EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 now, fmi3Float64 h, fmi3Boolean no_way_back,
                             fmi3Boolean *needs_event, fmi3Boolean *terminate, fmi3Boolean *early_return,
                             fmi3Float64 *last_time)
{
    instance *i = c;
    (void)no_way_back;
    *needs_event = *terminate = *early_return = false;
    const char *wrong = component_step(&i->c, now, h);
    *last_time = wrong ? now : now + h;
    return told(i, wrong);
}
