/* Hooks of a new processor. Fill in port.c. README.md says what each hook must do. */
#ifndef GPOM_PORTS_TEMPLATE_PORT_H
#define GPOM_PORTS_TEMPLATE_PORT_H

#include "ports/uart/device.h"

/** The hooks of your processor. */
gpom_port_t template_port(void);

#endif
