"""The tables of a report: comparison of models, and gait figures."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from markupsafe import Markup

from tracker.gait.figures import Gait
from tracker.gait.values import Measure, Value
from tracker.run.score import Score

SCORE_COLUMNS = (
    "model",
    "lost at frame",
    "followed",
    "mean error",
    "median error",
    "within 0.2 leg",
    "swaps",
    "leg angles",
)
GAIT_COLUMNS = ("", "near leg", "far leg", "both", "symmetry, %")
SIGMAS = 2.0  # standard errors after a plus-minus, like the two sigma of bands and ellipses
# Three decimals of seconds resolve frames, two of metres centimetres; angles and shares are less exact.
PLACES = {"s": 3, "m": 2, "m/s": 2, "leg lengths": 2, "leg lengths/s": 2}
DASH = "\N{EN DASH}"


def table_rows(scores: Mapping[str, Score]) -> list[tuple[str, ...]]:
    """One row a model, as text; errors in leg lengths."""
    return [(name, *_score_cells(result)) for name, result in scores.items()]


def _score_cells(result: Score) -> Iterator[str]:
    lost, angle = result.first_failure_frame, result.angle_median_deg
    yield "never" if lost is None else str(lost)
    yield f"{result.frames_followed} of {result.truth_frames}"
    yield f"{result.mean_error_leg:.3f}"
    yield f"{result.median_error_leg:.3f}"
    yield f"{100.0 * result.pck_02_leg:.0f} %"
    yield str(result.swaps)
    yield "" if angle is None else f"{angle:.1f} deg"


def in_columns(rows: Sequence[Sequence[str]]) -> str:
    """Rows of equally many cells as aligned lines of text."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    ]
    return "\n".join(lines)


def gait_table(gait: Gait) -> Markup:
    """The gait figures as HTML, each with two standard errors."""
    rows = []
    for measure in gait.measures:
        name = Markup("{} <small>{}</small>").format(measure.name, unit_of(measure))
        values = [spoken(value, measure.unit) for value in (measure.near, measure.far, measure.both)]
        rows.append([name, *map(small_errors, [*values, spoken(measure.symmetry, "%")])])
    return html_table(GAIT_COLUMNS, rows)


def unit_of(measure: Measure) -> str:
    """The unit of a measure as written."""
    return "\N{DEGREE SIGN}" if measure.unit == "deg" else measure.unit


def spoken(value: Value | None, unit: str) -> str:
    """A mean and two standard errors with the decimals of the unit; a dash for none."""
    if value is None:
        return DASH
    places = PLACES.get(unit, 1)
    # A minus sign as wide as the plus, and none before a rounded zero.
    mean = f"{value.mean:z.{places}f}".replace("-", "\N{MINUS SIGN}")
    return f"{mean} \N{PLUS-MINUS SIGN} {SIGMAS * value.error:.{places}f}"


def small_errors(text: str) -> Markup:
    """HTML of a figure from `spoken`, with its error in small type."""
    mean, sign, error = text.partition("\N{PLUS-MINUS SIGN}")
    return Markup("{}<small>{}</small>").format(mean, sign + error) if sign else Markup(mean)


def html_table(columns: Iterable[str], rows: Iterable[Sequence[str]]) -> Markup:
    """Rows of cells in HTML; text that is no Markup is escaped."""
    head, cell = Markup("<th scope='col'>{}</th>"), Markup("<td>{}</td>")
    row = Markup("<tr><th scope='row'>{}</th>{}</tr>")
    table = Markup("<div class='wide'><table><thead><tr>{}</tr></thead><tbody>{}</tbody></table></div>")
    nothing = Markup()
    return table.format(
        nothing.join(map(head.format, columns)),
        nothing.join(row.format(first, nothing.join(map(cell.format, rest))) for first, *rest in rows),
    )
