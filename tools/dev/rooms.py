"""The rooms of src/, ports/linux/ and tools/: which folder may include which.

A room may include itself and rooms of lower levels. Rooms of the same level may not include each
other.
"""
SRC_LEVELS = [["base"], ["lane"], ["gp", "beams"], ["raster"], ["map"],
              ["insert", "query", "align"], ["refresh", "plan", "snapshot", "move"]]
LINUX_LEVELS = [["base"], ["pose"], ["config"], ["lcm"], ["map"], ["out"]]
TOOLS_LEVELS = [["sim", "params_tool"], ["map"], ["eval", "slam"], ["learn", "live"]]
LEVELS = {"src": SRC_LEVELS, "ports/linux": LINUX_LEVELS, "tools": TOOLS_LEVELS}


def room_of(path):
    """(house, room) of a file. Room "" is above all rooms. None: the file is in no house."""
    for house in LEVELS:
        if path.startswith(house + "/"):
            inside = path[len(house) + 1:].split("/")
            return house, inside[0] if len(inside) > 1 else ""
    return None


def level_of(house, room):
    """Number of the room's level. Room "" has the highest. None: the room is not known."""
    levels = LEVELS[house]
    if room == "":
        return len(levels)
    return next((i for i, rooms in enumerate(levels) if room in rooms), None)


def room_fault(path, included):
    """Why a file may not include another, or None."""
    here, there = room_of(path), room_of(included)
    if here is None or there is None or here[0] != there[0] or here == there:
        return None
    own, other = level_of(*here), level_of(*there)
    if own is None or other is None:
        return f"{here[1] if own is None else there[1]} is no room of {here[0]}/"
    return None if other < own else f"{there[1] or 'the top'} is not below {here[1] or 'the top'}"
