"""Names of the counters and texts of the problems in gpom.status_t, in the order of the constants
of lcmtypes/gpom_status_t.lcm. Also the names of types by their fingerprints.
"""
TYPES = {
    0x1543f68f9b5f9666: "gpom.scan_t", 0x428375daa5a20b5c: "gpom.map_t",
    0x1ea00e74ace59f1c: "gpom.distances_t",
    0x9c14d72b736bf503: "gpom.status_t", 0xdbecc97130af3fa6: "gpom.query_t",
    0xefc9f7a58845fac3: "gpom.answer_t", 0xe3d17423180b5e8d: "bot_core.planar_lidar_t",
    0x2e16efb052b0105e: "bot_core.pose_t", 0x89dc5b879a5056cf: "mbot_lcm_msgs.lidar_t",
    0x1f317af1246276ac: "mbot_lcm_msgs.pose2D_t",
    0xd5447e494a66cc92: "mbot_lcm_msgs.occupancy_grid_t",
    0xe4b099a4cce13107: "occ_map.pixel_map_t"}
COUNTS = {0: "scans_received", 1: "scans_inserted", 2: "scans_bad_pose", 3: "scans_out_of_reach",
          4: "scans_other_type", 5: "scans_corrupt", 6: "scans_malformed", 7: "scans_lost",
          8: "scans_repeated", 9: "scans_reordered", 10: "scans_too_old", 11: "scans_too_new",
          12: "scans_jumped_back", 13: "scans_no_pose", 14: "scans_overrun", 15: "time_gaps",
          16: "poses_received", 17: "poses_refused", 18: "frame_jumps", 19: "scans_at_jump",
          20: "poses_at_jump", 24: "beams_hit", 25: "beams_no_return",
          26: "beams_nan", 27: "beams_not_positive", 28: "beams_too_near", 29: "beams_masked",
          30: "beams_full", 31: "beams_known", 32: "beams_contradicting", 33: "beams_ids_spent",
          34: "kept_evicted", 40: "maps_published", 41: "tiles_published", 42: "queries_answered",
          43: "queries_refused", 44: "snapshots_written", 45: "snapshots_failed",
          46: "grids_not_sent",
          48: "can_received", 49: "can_bad_length", 50: "can_bad_crc", 51: "can_bad_counter",
          52: "can_bad_value", 53: "can_lost", 54: "can_reordered", 55: "can_errors",
          56: "can_bus_offs", 57: "can_overflows", 58: "can_downs", 59: "can_sent",
          60: "can_not_sent", 61: "odometry_gaps", 62: "mavlink_sent", 63: "mavlink_not_sent",
          64: "frames_received", 65: "frames_short", 66: "frames_long", 67: "frames_corrupt",
          68: "frames_repeated", 69: "frames_lost", 70: "datagrams_refused",
          71: "messages_incomplete", 72: "messages_other", 73: "line_overruns",
          74: "watchdog_resets",
          75: "datagrams_lost", 76: "datagrams_other", 77: "datagrams_malformed",
          78: "fragments_overlong", 79: "fragments_inconsistent", 80: "fragments_repeated",
          81: "fragments_late", 82: "messages_timed_out", 83: "messages_evicted",
          84: "messages_not_sent"}
N_COUNTS = 88  # some have no name yet
PROBLEMS_PLACE = 87
PROBLEMS = [  # in the order of their bits, lowest first; gpomd's log also names channel and value
    ("scan_type", "a scan channel carries another type than its [[sensor]] says: set type, or "
                  "another channel"),
    ("scan_crc_zero", "a gpom.scan_t has crc32 0: its sender must compute it (lcmtypes/README.md)"),
    ("scan_corrupt", "the CRC-32 of a gpom.scan_t does not fit: damaged, or computed wrongly"),
    ("scan_length", "the length of a scan does not match its counts: does the sender use another "
                    ".lcm file?"),
    ("scan_ranges", "a scan has more ranges than intake.ranges_max: raise intake.ranges_max"),
    ("scan_sensor_id", "no [[sensor]] has the sensor_id of a gpom.scan_t: set id, or add a "
                       "[[sensor]]"),
    ("scan_angles", "the bearings of a scan go over two turns, or are not finite: are they "
                    "degrees?"),
    ("scan_beam_times", "a beam's time is over 1 s from its scan's: are times in microseconds?"),
    ("stamp_unit", "utime is in seconds, milliseconds or nanoseconds: it must be in microseconds"),
    ("stamp_range", "utime is negative or centuries ahead: it must be in microseconds since 1970"),
    ("scan_too_old", "a scan is older than intake.age_max_s: set the sender's clock, or raise "
                     "that"),
    ("scan_too_new", "a scan is ahead of the clock by more than intake.ahead_max_s: set the "
                     "clocks"),
    ("scan_lost", "numbers of scans are missing: the network or this machine loses them"),
    ("scan_repeated", "a scan's number or utime came before: two senders, or utime never changes"),
    ("scan_reordered", "a scan came after a later one: two senders share a channel, or the "
                       "network reorders"),
    ("scan_back", "a scan is stamped before the one before: its clock is being set, or there are "
                  "two senders"),
    ("scan_gap", "a sensor was silent for longer than its gap_max_s"),
    ("scan_overrun", "more scans come than the map takes: lower intake.step_ops or send fewer"),
    ("scan_bad_pose", "the pose of a scan is not finite, is beyond 1e8 m, or has a bad covariance"),
    ("scan_out_of_reach", "a scan was taken over 8 km from map.origin: set that, or map.rebase_m"),
    ("scan_unusable", "no reading of a scan is usable: the sensor is covered, or its driver "
                      "means something else; see zero, range_min_m, masks"),
    ("scan_no_pose", "a scan had no pose after pose.wait_max_s: is the localiser running, is it "
                     "late?"),
    ("scan_pose_gap", "the poses before and after a scan are over pose.gap_max_s apart"),
    ("scan_before_poses", "a scan is older than all poses that are kept"),
    ("two_clocks", "scans and poses are stamped by two clocks: give both the same clock"),
    ("latency", "scans are stamped later or earlier than poses: set latency_s as gpomd's log says"),
    ("pose_type", "the pose channel carries another type than [pose] says: set type, or another "
                  "channel"),
    ("pose_length", "a pose has another length than its type: is the sender's .lcm file another "
                    "one?"),
    ("pose_quaternion", "the quaternion of a pose is not of unit length: an orientation left at "
                        "0?"),
    ("pose_not_finite", "a pose is NaN or infinite: the localiser is lost"),
    ("pose_order", "a pose is not later than the one before: two localisers, or utime stands "
                   "still"),
    ("pose_too_new", "a pose is ahead of the clock by more than intake.ahead_max_s: set the "
                     "clocks"),
    ("pose_wild", "a pose is farther from the one before than the robot can have gone: see [jump]"),
    ("silent", "nothing comes on a channel that gpomd listens to: is its sender running?"),
    ("other_channel", "nothing comes on a channel, but its type comes on another: set channel"),
    ("two_mappers", "another program sends statuses, too: a second gpomd, or a log that is played"),
    ("query_refused", "a query is malformed, without crc32, or one too many"),
    ("snapshot_failed", "a snapshot could not be written: is the disk full, the folder gone?"),
    ("not_sent", "the network takes less than is sent, or there is no route for multicast"),
    ("datagrams_lost", "the socket's buffer was full: raise net.core.rmem_max, start gpomd again"),
    ("datagrams_bad", "another program sends other data to LCM's port"),
    ("messages_incomplete", "fragments of messages are lost on the way"),
    ("can_frames", "CAN frames do not fit [can.odometry]: compare them with `candump`"),
    ("can_bus", "CAN frames are lost or not sent: `ip -details -statistics link show`"),
    ("mavlink", "MAVLink messages are not sent: is mavlink.to right, and does the autopilot "
                "listen?"),
]
