/** \file gpom.h
 *  The whole library: include this header.
 *
 *  - scan.h: put scans with poses in.
 *  - align.h: find the pose at which a scan fits the map.
 *  - query.h: get answers at any point.
 *  - gradient.h: answers with their derivatives.
 *  - lowres.h: rasters for planners.
 *  - path.h: paths, and places to explore, for planners.
 *  - distances.h: distances to obstacles, with gradients.
 *  - sectors.h: how far all is free about a pose.
 *  - ray.h: how far a beam would go, and whole simulated scans.
 *  - map.h: the map itself, in memory of the caller.
 *  - live.h: keep a map up to date in slices of work.
 *  - exchange.h: beams leave a map and enter another one.
 *  - repose.h: move the map's beams when a SLAM corrects the poses of the past.
 *  - params.h: hyperparameters.
 *  - snapshot.h: store a map, so that it outlives a loss of power.
 *  - status.h: status codes and versions. */
#ifndef GPOM_GPOM_H
#define GPOM_GPOM_H

#include "gpom/align.h"
#include "gpom/distances.h"
#include "gpom/exchange.h"
#include "gpom/gradient.h"
#include "gpom/live.h"
#include "gpom/lowres.h"
#include "gpom/map.h"
#include "gpom/params.h"
#include "gpom/path.h"
#include "gpom/query.h"
#include "gpom/ray.h"
#include "gpom/repose.h"
#include "gpom/scan.h"
#include "gpom/sectors.h"
#include "gpom/snapshot.h"
#include "gpom/status.h"

#endif
