/** \file codec.h
 *  The whole codec: it reads and writes LCM messages and datagrams in caller memory. */
#ifndef GPOM_CODEC_CODEC_H
#define GPOM_CODEC_CODEC_H

#include "ports/codec/bot_core.h"
#include "ports/codec/datagram.h"
#include "ports/codec/gpom_distances.h"
#include "ports/codec/gpom_map.h"
#include "ports/codec/gpom_query.h"
#include "ports/codec/gpom_scan.h"
#include "ports/codec/gpom_status.h"
#include "ports/codec/mbot.h"
#include "ports/codec/occ_map.h"
#include "ports/codec/receiver.h"
#include "ports/codec/wire.h"

#endif
