"""Odometry's section of RESULTS.md: figures of gpom-odometry as Markdown tables."""
PARAMS = "tools/params/street.toml"
DRIVES = ((34, 2), (34, 4), (12, 2), (12, 4))  # range [m], seconds between poses
# The row with the same poses, but not weighed.
UNWEIGHED = {"every": "every_unweighed", "weighed": "unweighed", "plain_weighed": "plain_unweighed"}

TEXT = """400 scans of 91 beams on a street, 200 m at 2 to 8 m/s. Every scan has a pose, or a pose
comes every `--period` seconds. Poses have standard deviations of 0.02 m and 0.004 rad. For each
drive, the constant errors of wheels and gyro are drawn with standard deviations of 2 % and 0.005
rad/s. White errors are 0.01 m / sqrt(s) and 0.001 rad / sqrt(s), with 50 samples a second. gpomd
knows these figures and learns the constant errors from the poses. The map is kept as gpomd keeps
it. 20,000 random places within 5 m of a beam judge. "Weighed": the covariance of a pose goes into
the map with the scan. "Place": root mean square error of the scans' places. "Better weighed":
number of seeds on which the map of the same poses has a smaller NLL if they are weighed. The spread
over the seeds is in brackets.
"""


def name(range_m, period_s):
    return f"odometry {range_m} {period_s}"


def caption(range_m, period_s):
    return f"Range {range_m} m, a pose every {period_s} s:\n"


def words(range_m, period_s, seed):
    """Words of gpom-odometry."""
    return ("--params", PARAMS, "--range-max", str(range_m), "--period", str(period_s), "--seed",
            str(seed))


def mean_and_spread(values, digits=4):
    return f"{sum(values) / len(values):.{digits}f} ({max(values) - min(values):.{digits}f})"


def table(reports):
    """Header and rows. reports: the reports of gpom-odometry, seed by seed."""
    def of(key, figure):
        return [row[figure] for report in reports for row in report["rows"] if row["key"] == key]

    def better_weighed(key):
        if key not in UNWEIGHED:
            return ""
        pairs = list(zip(of(key, "nll"), of(UNWEIGHED[key], "nll")))
        return f"{sum(weighed < other for weighed, other in pairs)} of {len(pairs)}"
    rows, of_every = [], of("every", "nll")
    for i, first in enumerate(reports[0]["rows"]):
        of_row = [report["rows"][i] for report in reports]
        nll = [row["nll"] for row in of_row]
        rows.append([
            first["label"], mean_and_spread(nll), f"{100 * (sum(nll) / sum(of_every) - 1):+.1f} %",
            mean_and_spread([row["auc"] for row in of_row]),
            mean_and_spread([row["ece"] for row in of_row]),
            mean_and_spread([row["place_error_m"] for row in of_row], 3),
            str(round(sum(row["scans"] for row in of_row) / len(of_row))),
            better_weighed(first["key"])])
    return ["poses", "NLL", "against every pose", "AUC", "ECE", "place [m]", "scans",
            "better weighed"], rows
