#ifndef FMI3_INSTANCE_H
#define FMI3_INSTANCE_H

#include "component.h"
#include "exported.h"
#include "fmi3_types.h"

typedef struct {
    component c;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} instance;

/* Tells the simulator what is wrong, if anything is. */
fmi3Status told(instance *i, const char *wrong);

#endif
