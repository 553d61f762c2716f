"""Odometry's section of RESULTS.md: figures of gpom-odometry as Markdown tables."""
PARAMS = "tools/params/street.toml"
RANGES_M = (34, 12)

TEXT = """400 scans of 91 beams on a street, 200 m at 2 to 8 m/s; every scan has a pose, or a pose
comes every 2 s. Poses have standard deviations of 0.02 m and 0.004 rad. Of each drive's wheels
and gyro the constant errors are drawn with standard deviations of 2 % and 0.005 rad/s, white errors
are 0.01 m / sqrt(s) and 0.001 rad / sqrt(s), 50 samples a second; gpomd is told these figures and
learns the constant errors from the poses. The map is kept as gpomd keeps it; 20,000 random places
within 5 m of a beam judge. "Weighed": the covariance of a pose goes with the scan into the map.
"Place": root mean square error of the scans' places. "Better on": seeds on which the map has less
NLL than the one with odometry, learnt and weighed. In brackets the spread over the seeds.
"""


def words(range_m, seed):
    """Words of gpom-odometry."""
    return ("--params", PARAMS, "--range-max", str(range_m), "--seed", str(seed))


def mean_and_spread(values, digits=4):
    return f"{sum(values) / len(values):.{digits}f} ({max(values) - min(values):.{digits}f})"


def table(reports):
    """Header and rows. reports: those of gpom-odometry, seed by seed."""
    rows = []
    judge = [row["nll"] for report in reports for row in report["rows"] if row["key"] == "weighed"]
    of_every = [row["nll"] for report in reports for row in report["rows"] if row["key"] == "every"]
    for i, first in enumerate(reports[0]["rows"]):
        of_row = [report["rows"][i] for report in reports]
        nll = [row["nll"] for row in of_row]
        n_better = sum(a < b for a, b in zip(nll, judge))
        rows.append([
            first["label"], mean_and_spread(nll), f"{100 * (sum(nll) / sum(of_every) - 1):+.1f} %",
            mean_and_spread([row["auc"] for row in of_row]),
            mean_and_spread([row["ece"] for row in of_row]),
            mean_and_spread([row["place_error_m"] for row in of_row], 3),
            str(round(sum(row["scans"] for row in of_row) / len(of_row))),
            "" if first["key"] == "weighed" else f"{n_better} of {len(nll)}"])
    return ["poses", "NLL", "against every pose", "AUC", "ECE", "place [m]", "scans",
            "better on"], rows
