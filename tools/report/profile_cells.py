"""Table cells for the answers of maps before and behind a surface."""
# Offset from the surface [m], and the share to show for it.
SHARES = ((-0.3, "share_free"), (-0.2, "share_free"), (-0.1, "share_free"), (-0.05, "share_free"),
          (-0.1, "share_occupied"), (0.05, "share_occupied"))
PROFILE_TITLES = ["p = .5 at [m]", *(f"{share.removeprefix('share_')} at {offset:+g} m [%]"
                                     for offset, share in SHARES)]


def crossing_cell(profiles):
    """Mean offset at which the mean probability rises to one half, over profiles that have one."""
    found = [p["crossing_m"] for p in profiles if p["crossing_m"] is not None]
    if not found:
        return "never"
    text = f"{sum(found) / len(found):+.3f}"
    return text if len(found) == len(profiles) else f"{text} ({len(found)} of {len(profiles)})"


def share_cell(profiles, offset, share):
    values = [row[share] for profile in profiles for row in profile["rows"]
              if row["offset_m"] == offset]
    return f"{100 * sum(values) / len(values):.0f}" if values else "-"


def profile_cells(profiles):
    """A cell for each of PROFILE_TITLES, means over the profiles of gpom-eval or gpom-live."""
    if not profiles:
        return ["-"] * len(PROFILE_TITLES)
    return [crossing_cell(profiles), *(share_cell(profiles, *column) for column in SHARES)]
