/* Hooks of a new processor: fill port.c (README.md says what each must do). */
#ifndef GPOM_PORTS_TEMPLATE_PORT_H
#define GPOM_PORTS_TEMPLATE_PORT_H

#include "ports/uart/device.h"

/** The hooks. */
gpom_port_t template_port(void);

#endif
