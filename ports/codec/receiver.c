#include "ports/codec/receiver.h"

#include "ports/codec/datagram.h"

#include <string.h>

/* The states of a slot: empty, then filling, then complete or given up. A complete or given-up slot
 * still knows its message, so that late fragments do not count as a new message. Such slots are
 * reused before slots that are filling. */
enum { EMPTY = 0, FILLING, COMPLETE, GIVEN_UP };

#define UNKNOWN UINT32_MAX

static size_t bitmap_bytes(const gpom_wire_receiver_config_t *config)
{
    return ((size_t)config->fragments_max + 63) / 64 * 8;
}

/* Bytes of one slot with its bitmap and data. */
static size_t bytes_per_slot(const gpom_wire_receiver_config_t *config)
{
    return GPOM_WIRE_RECEIVER_BYTES(1, config->message_bytes_max, config->fragments_max);
}

gpom_status_t gpom_wire_receiver_init(gpom_wire_receiver_t *receiver,
                                      const gpom_wire_receiver_config_t *config, void *mem,
                                      size_t mem_bytes)
{
    if (receiver == NULL || config == NULL || config->timeout_us <= 0) {
        return GPOM_ERR_ARG;
    }
    if (config->fragments_max == 0 || config->fragments_max > UINT16_MAX ||
        config->message_bytes_max > INT32_MAX) {
        return GPOM_ERR_ARG;
    }
    if (config->n_slots > 0 && (mem == NULL || (uintptr_t)mem % 8 != 0)) {
        return GPOM_ERR_MEM;
    }
    if (config->n_slots > mem_bytes / bytes_per_slot(config)) {
        return GPOM_ERR_MEM;
    }
    memset(receiver, 0, sizeof *receiver);
    receiver->config = *config;
    receiver->slots = mem;
    uint8_t *at = (uint8_t *)mem + sizeof(gpom_wire_slot_t) * config->n_slots;
    for (uint32_t i = 0; i < config->n_slots; ++i) {
        gpom_wire_slot_t *const slot = &receiver->slots[i];
        memset(slot, 0, sizeof *slot);
        slot->bitmap = (uint64_t *)(void *)at;
        slot->data = at + bitmap_bytes(config);
        at += bytes_per_slot(config) - sizeof(gpom_wire_slot_t);
    }
    return GPOM_OK;
}

void gpom_wire_receiver_expire(gpom_wire_receiver_t *receiver, int64_t now_us)
{
    for (uint32_t i = 0; i < receiver->config.n_slots; ++i) {
        gpom_wire_slot_t *const slot = &receiver->slots[i];
        if (slot->state == EMPTY || now_us - slot->stamp_us < receiver->config.timeout_us) {
            continue;
        }
        if (slot->state == FILLING) {
            ++receiver->stats.messages_timed_out;
            slot->state = GIVEN_UP;
            slot->stamp_us = now_us;
        } else {
            slot->state = EMPTY;
        }
    }
}

/* The slot of a message, or NULL. */
static gpom_wire_slot_t *find(gpom_wire_receiver_t *receiver, uint64_t sender, uint32_t sequence)
{
    for (uint32_t i = 0; i < receiver->config.n_slots; ++i) {
        gpom_wire_slot_t *const slot = &receiver->slots[i];
        if (slot->state != EMPTY && slot->sender == sender && slot->sequence == sequence) {
            return slot;
        }
    }
    return NULL;
}

/* True if slot a should be reused before slot b. Empty slots come first, then complete and given-up
 * ones, then filling ones. Of slots with the same rank, the one with the oldest stamp comes first.
 */
static bool is_better_victim(const gpom_wire_slot_t *a, const gpom_wire_slot_t *b)
{
    const int rank_a = a->state == EMPTY ? 0 : a->state == FILLING ? 2 : 1;
    const int rank_b = b->state == EMPTY ? 0 : b->state == FILLING ? 2 : 1;
    return rank_a != rank_b ? rank_a < rank_b : a->stamp_us < b->stamp_us;
}

static gpom_wire_slot_t *claim(gpom_wire_receiver_t *receiver, const gpom_wire_datagram_t *d,
                               uint64_t sender)
{
    gpom_wire_slot_t *slot = &receiver->slots[0];
    for (uint32_t i = 1; i < receiver->config.n_slots; ++i) {
        if (is_better_victim(&receiver->slots[i], slot)) {
            slot = &receiver->slots[i];
        }
    }
    receiver->stats.messages_evicted += slot->state == FILLING;
    slot->state = FILLING;
    slot->sender = sender;
    slot->sequence = d->sequence;
    slot->message_bytes = d->message_bytes;
    slot->n_fragments = d->n_fragments;
    slot->first_bytes = slot->stride_bytes = slot->last_offset = UNKNOWN;
    slot->n_received = slot->i_highest = 0;
    memset(slot->bitmap, 0, bitmap_bytes(&receiver->config));
    return slot;
}

static bool agrees(uint32_t known, uint32_t value) { return known == UNKNOWN || known == value; }

/* True if a fragment fits the other fragments of its message. Every sender cuts a message in the
 * same way. The first fragment is shorter because it contains the channel name. The fragments
 * between the first and the last all have the same size. So each fragment between them tells where
 * the others lie, and fragments can neither overlap nor leave a hole. */
static bool fits_in(gpom_wire_slot_t *slot, const gpom_wire_datagram_t *d)
{
    if (slot->message_bytes != d->message_bytes || slot->n_fragments != d->n_fragments) {
        return false;
    }
    if (d->i_fragment == 0) {
        if (!agrees(slot->first_bytes, d->payload_bytes)) {
            return false;
        }
        slot->first_bytes = d->payload_bytes;
    } else if (d->i_fragment + 1 == d->n_fragments) {
        slot->last_offset = d->offset;
    } else {
        const uint32_t between = (d->i_fragment - 1u) * d->payload_bytes; /* < 2^32 */
        if (between > d->offset || !agrees(slot->first_bytes, d->offset - between) ||
            !agrees(slot->stride_bytes, d->payload_bytes)) {
            return false;
        }
        slot->first_bytes = d->offset - between;
        slot->stride_bytes = d->payload_bytes;
    }
    return true;
}

/* True if all fragments together fill the message. Call it when all have come. */
static bool is_filled(const gpom_wire_slot_t *slot)
{
    if (slot->n_fragments == 1) {
        return true;
    }
    const uint64_t between =
        slot->n_fragments > 2 ? (slot->n_fragments - 2ull) * slot->stride_bytes : 0;
    return slot->first_bytes + between == slot->last_offset;
}

static bool take(gpom_wire_receiver_t *receiver, gpom_wire_slot_t *slot,
                 const gpom_wire_datagram_t *d, int64_t now_us)
{
    uint64_t *const word = &slot->bitmap[d->i_fragment / 64];
    const uint64_t bit = UINT64_C(1) << (d->i_fragment % 64);
    if ((*word & bit) != 0) {
        ++receiver->stats.fragments_repeated;
        return false;
    }
    if (!fits_in(slot, d)) {
        ++receiver->stats.fragments_inconsistent;
        return false;
    }
    *word |= bit;
    memcpy(slot->data + d->offset, d->payload, d->payload_bytes);
    if (d->channel != NULL) {
        memcpy(slot->channel, d->channel, (size_t)((const char *)d->payload - d->channel));
    }
    receiver->stats.fragments_reordered += d->i_fragment < slot->i_highest;
    slot->i_highest = d->i_fragment > slot->i_highest ? d->i_fragment : slot->i_highest;
    slot->stamp_us = now_us;
    ++slot->n_received;
    if (slot->n_received < slot->n_fragments) {
        return false;
    }
    slot->state = is_filled(slot) ? COMPLETE : GIVEN_UP;
    receiver->stats.fragments_inconsistent += slot->state == GIVEN_UP;
    return slot->state == COMPLETE;
}

static bool take_fragment(gpom_wire_receiver_t *receiver, const gpom_wire_datagram_t *d,
                          const gpom_wire_arrival_t *arrival, gpom_wire_message_t *message)
{
    const gpom_wire_receiver_config_t *const config = &receiver->config;
    gpom_wire_receiver_stats_t *const stats = &receiver->stats;
    if (config->n_slots == 0 || d->message_bytes > config->message_bytes_max ||
        d->n_fragments > config->fragments_max) {
        ++stats->fragments_overlong;
        return false;
    }
    gpom_wire_slot_t *slot = find(receiver, arrival->sender, d->sequence);
    if (slot == NULL) {
        slot = claim(receiver, d, arrival->sender);
    }
    if (slot->state != FILLING) {
        stats->fragments_repeated += slot->state == COMPLETE;
        stats->fragments_late += slot->state == GIVEN_UP;
        return false;
    }
    if (!take(receiver, slot, d, arrival->now_us)) {
        return false;
    }
    ++stats->messages_assembled;
    message->channel = slot->channel;
    message->payload = slot->data;
    message->payload_bytes = slot->message_bytes;
    message->sequence = slot->sequence;
    return true;
}

bool gpom_wire_receive(gpom_wire_receiver_t *receiver, const gpom_wire_arrival_t *arrival,
                       gpom_wire_message_t *message)
{
    if (receiver == NULL || arrival == NULL || message == NULL) {
        return false;
    }
    gpom_wire_receiver_expire(receiver, arrival->now_us);
    gpom_wire_datagram_t d;
    const gpom_wire_fault_t fault = gpom_wire_datagram_read(&d, arrival->bytes, arrival->n_bytes);
    if (fault != GPOM_WIRE_OK) {
        receiver->stats.datagrams_other += fault == GPOM_WIRE_TYPE;
        receiver->stats.datagrams_malformed += fault != GPOM_WIRE_TYPE;
        return false;
    }
    if (d.n_fragments > 0) {
        return take_fragment(receiver, &d, arrival, message);
    }
    ++receiver->stats.messages_short;
    message->channel = d.channel;
    message->payload = d.payload;
    message->payload_bytes = d.payload_bytes;
    message->sequence = d.sequence;
    return true;
}
