#ifndef WALL_H
#define WALL_H

#include <gpom/gpom.h>

/* Put a wall into the map, 5 m before a robot at the origin that looks along x. */
gpom_status_t see_wall(gpom_map_t *map);

#endif
