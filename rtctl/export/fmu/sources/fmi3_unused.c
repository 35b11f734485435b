/* Functions of FMI 3.0 that a binary must have and a co-simulation of real scalars has no use for. */
#include "fmi3_instance.h"

#define REFERENCES fmi3Instance c, const fmi3ValueReference vr[], size_t n
#define NOTHING_TO_DO(what) return n ? told(c, what) : fmi3OK

#define NO_VARIABLES(type) \
    EXPORT fmi3Status fmi3Get##type(REFERENCES, fmi3##type values[], size_t count) \
    { \
        (void)vr; (void)values; (void)count; \
        NOTHING_TO_DO("this FMU has variables of type Float64 alone"); \
    } \
    EXPORT fmi3Status fmi3Set##type(REFERENCES, const fmi3##type values[], size_t count) \
    { \
        (void)vr; (void)values; (void)count; \
        NOTHING_TO_DO("this FMU has variables of type Float64 alone"); \
    }

NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
NO_VARIABLES(Int32)
NO_VARIABLES(UInt32)
NO_VARIABLES(Int64)
NO_VARIABLES(UInt64)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)

EXPORT fmi3Status fmi3GetBinary(REFERENCES, size_t sizes[], fmi3Binary values[], size_t count)
{
    (void)vr; (void)sizes; (void)values; (void)count;
    NOTHING_TO_DO("this FMU has variables of type Float64 alone");
}

EXPORT fmi3Status fmi3SetBinary(REFERENCES, const size_t sizes[], const fmi3Binary values[], size_t count)
{
    (void)vr; (void)sizes; (void)values; (void)count;
    NOTHING_TO_DO("this FMU has variables of type Float64 alone");
}

EXPORT fmi3Status fmi3GetClock(REFERENCES, fmi3Clock values[])
{
    (void)vr; (void)values;
    NOTHING_TO_DO("this FMU has no clocks");
}

EXPORT fmi3Status fmi3SetClock(REFERENCES, const fmi3Clock values[])
{
    (void)vr; (void)values;
    NOTHING_TO_DO("this FMU has no clocks");
}

EXPORT fmi3Status fmi3GetIntervalDecimal(REFERENCES, fmi3Float64 values[], fmi3IntervalQualifier qualifiers[])
{
    (void)vr; (void)values; (void)qualifiers;
    NOTHING_TO_DO("this FMU has no clocks");
}

EXPORT fmi3Status fmi3GetIntervalFraction(REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                          fmi3IntervalQualifier qualifiers[])
{
    (void)vr; (void)counters; (void)resolutions; (void)qualifiers;
    NOTHING_TO_DO("this FMU has no clocks");
}

EXPORT fmi3Status fmi3GetShiftDecimal(REFERENCES, fmi3Float64 values[])
{
    (void)vr; (void)values;
    NOTHING_TO_DO("this FMU has no clocks");
}

EXPORT fmi3Status fmi3GetShiftFraction(REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
{
    (void)vr; (void)counters; (void)resolutions;
    NOTHING_TO_DO("this FMU has no clocks");
}

EXPORT fmi3Status fmi3SetIntervalDecimal(REFERENCES, const fmi3Float64 values[])
{
    (void)vr; (void)values;
    NOTHING_TO_DO("this FMU has no clocks");
}

EXPORT fmi3Status fmi3SetIntervalFraction(REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    (void)vr; (void)counters; (void)resolutions;
    NOTHING_TO_DO("this FMU has no clocks");
}

EXPORT fmi3Status fmi3SetShiftDecimal(REFERENCES, const fmi3Float64 values[])
{
    (void)vr; (void)values;
    NOTHING_TO_DO("this FMU has no clocks");
}

EXPORT fmi3Status fmi3SetShiftFraction(REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    (void)vr; (void)counters; (void)resolutions;
    NOTHING_TO_DO("this FMU has no clocks");
}

EXPORT fmi3Status fmi3GetOutputDerivatives(REFERENCES, const fmi3Int32 orders[], fmi3Float64 values[], size_t count)
{
    (void)vr; (void)orders; (void)values; (void)count;
    NOTHING_TO_DO("outputs have no derivatives");
}

#define DERIVATIVES(name) \
    EXPORT fmi3Status name(fmi3Instance c, const fmi3ValueReference unknowns[], size_t nUnknowns, \
                           const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, \
                           fmi3Float64 sensitivity[], size_t nSensitivity) \
    { \
        (void)unknowns; (void)nUnknowns; (void)knowns; (void)nKnowns; (void)seed; (void)nSeed; (void)sensitivity; \
        (void)nSensitivity; \
        return told(c, "this FMU has no directional or adjoint derivatives"); \
    }

DERIVATIVES(fmi3GetDirectionalDerivative)
DERIVATIVES(fmi3GetAdjointDerivative)

EXPORT fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t *count)
{
    (void)vr; (void)count;
    return told(c, "dependencies do not change; they are in modelDescription.xml");
}

EXPORT fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference dependent, size_t elements[],
                                              fmi3ValueReference independents[], size_t on[],
                                              fmi3DependencyKind kinds[], size_t count)
{
    (void)dependent; (void)elements; (void)independents; (void)on; (void)kinds; (void)count;
    return told(c, "dependencies do not change; they are in modelDescription.xml");
}

#define NO_MODE(name, what) \
    EXPORT fmi3Status name(fmi3Instance c) { return told(c, what); }

NO_MODE(fmi3EnterEventMode, "this FMU has no event mode")
NO_MODE(fmi3EnterStepMode, "this FMU has no event mode")
NO_MODE(fmi3EvaluateDiscreteStates, "this FMU has no event mode")
NO_MODE(fmi3EnterConfigurationMode, "this FMU has no structural parameters")
NO_MODE(fmi3ExitConfigurationMode, "this FMU has no structural parameters")
NO_MODE(fmi3EnterContinuousTimeMode, "this FMU is for co-simulation alone")

EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                           fmi3Boolean *nominals, fmi3Boolean *states, fmi3Boolean *has_time,
                                           fmi3Float64 *time)
{
    (void)again; (void)terminate; (void)nominals; (void)states; (void)has_time; (void)time;
    return told(c, "this FMU has no event mode");
}

EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                                 fmi3Boolean visible, fmi3Boolean logging,
                                                 fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    (void)name; (void)token; (void)resources; (void)visible; (void)logging;
    if (log) log(environment, fmi3Error, "logStatusError", "this FMU is for co-simulation alone");
    return 0;
}

EXPORT fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3ClockUpdateCallback update,
    fmi3LockPreemptionCallback lock, fmi3LockPreemptionCallback unlock)
{
    (void)name; (void)token; (void)resources; (void)visible; (void)logging; (void)update; (void)lock; (void)unlock;
    if (log) log(environment, fmi3Error, "logStatusError", "this FMU is for co-simulation alone");
    return 0;
}

EXPORT fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time)
{
    (void)clock; (void)time;
    return told(c, "this FMU has no clocks");
}

EXPORT fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_way_back, fmi3Boolean *event,
                                              fmi3Boolean *terminate)
{
    (void)no_way_back; (void)event; (void)terminate;
    return told(c, "this FMU is for co-simulation alone");
}

EXPORT fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time)
{
    (void)time;
    return told(c, "this FMU is for co-simulation alone");
}

EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 states[], size_t n)
{
    (void)states;
    NOTHING_TO_DO("this FMU is for co-simulation alone");
}

#define NO_STATES(name) \
    EXPORT fmi3Status name(fmi3Instance c, fmi3Float64 values[], size_t n) \
    { \
        (void)values; \
        NOTHING_TO_DO("this FMU is for co-simulation alone"); \
    }

NO_STATES(fmi3GetContinuousStateDerivatives)
NO_STATES(fmi3GetEventIndicators)
NO_STATES(fmi3GetContinuousStates)
NO_STATES(fmi3GetNominalsOfContinuousStates)

#define NO_NUMBER(name) \
    EXPORT fmi3Status name(fmi3Instance c, size_t *n) \
    { \
        (void)n; \
        return told(c, "this FMU is for co-simulation alone"); \
    }

NO_NUMBER(fmi3GetNumberOfEventIndicators)
NO_NUMBER(fmi3GetNumberOfContinuousStates)
