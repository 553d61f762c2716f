/** \file gpom.h
 *  Everything: include this one.
 *
 *  Scans with poses go in (scan.h), answers at any point come out (query.h); the map (map.h) lives
 *  in the caller's memory and is shaped by hyperparameters (params.h). A snapshot (snapshot.h) lets
 *  it outlive a loss of power. */
#ifndef GPOM_GPOM_H
#define GPOM_GPOM_H

#include "gpom/map.h"
#include "gpom/params.h"
#include "gpom/query.h"
#include "gpom/scan.h"
#include "gpom/snapshot.h"
#include "gpom/status.h"

#endif
