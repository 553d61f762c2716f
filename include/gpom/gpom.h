/** \file gpom.h
 *  Everything: include this one.
 *
 *  Scans with poses go in (scan.h), answers at any point come out (query.h), and for planners
 *  rasters (lowres.h), paths and places to explore (path.h); the map (map.h) lives in the caller's
 *  memory, is kept alive in slices (live.h), shaped by hyperparameters (params.h), and outlives a
 *  loss of power as a snapshot (snapshot.h). */
#ifndef GPOM_GPOM_H
#define GPOM_GPOM_H

#include "gpom/live.h"
#include "gpom/lowres.h"
#include "gpom/map.h"
#include "gpom/params.h"
#include "gpom/path.h"
#include "gpom/query.h"
#include "gpom/scan.h"
#include "gpom/snapshot.h"
#include "gpom/status.h"

#endif
