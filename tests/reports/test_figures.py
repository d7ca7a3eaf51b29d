import numpy as np
import pyarrow as pa
import pytest
from matplotlib.figure import Figure

from pipeline.errors import TableError
from pipeline.evaluation.calibration import calibrate
from pipeline.evaluation.paired import PairedCosts
from pipeline.evaluation.trimmed_line import fit_origin_line
from pipeline.files import write_table
from pipeline.reports.calibration import draw_reliability
from pipeline.reports.scatter import Named, draw_cost_scatter, draw_ratio_histogram
from pipeline.reports.style import BLUE, colours_of
from pipeline.reports.training import draw_training, read_curves

OURS = Named("learned", BLUE)


def costs(size: int) -> PairedCosts:
    rng = np.random.default_rng(size)
    baseline = rng.uniform(5.0, 40.0, size)
    names = tuple(str(index) for index in range(size))
    return PairedCosts(names, names, baseline, baseline * rng.uniform(0.4, 1.3, size), {})


def legend_of(figure: Figure) -> list[str]:
    legend = figure.axes[0].get_legend()
    assert legend is not None
    return [text.get_text() for text in legend.get_texts()]


@pytest.mark.parametrize("size", [1, 20, 400])
def test_the_scatter_has_equal_axes_and_says_slope_and_ratio(size: int) -> None:
    paired = costs(size)
    line = fit_origin_line(paired.baseline_m, paired.ours_m, rng=np.random.default_rng(0))
    figure = draw_cost_scatter(paired, line, OURS, "optimistic", with_intercept=(0.625, -3.25))
    (axes,) = figure.axes
    assert axes.get_aspect() == 1.0
    assert axes.get_xlim() == axes.get_ylim()
    words = legend_of(figure)
    assert f"trimmed slope {line.slope:.3f}" in words
    assert "RANSAC 0.625 x - 3.2 m" in words
    dotted = next(drawn for drawn in figure.axes[0].lines if drawn.get_linestyle() == ":")
    (x0, x1), (y0, y1) = dotted.get_xdata(), dotted.get_ydata()
    assert (x0, y0) == (0, -3.25)
    assert (y1 - y0) / (x1 - x0) == pytest.approx(0.625)
    assert f"total ratio {paired.ours_m.sum() / paired.baseline_m.sum():.3f}" in words
    assert f"inliers ({line.inliers.sum()} of {size})" in words


def test_inliers_are_filled_and_outliers_hollow() -> None:
    paired = costs(40)
    line = fit_origin_line(paired.baseline_m, paired.ours_m, rng=np.random.default_rng(0))
    filled, hollow = draw_cost_scatter(paired, line, OURS, "optimistic").axes[0].collections[-2:]
    assert (len(filled.get_offsets()), len(hollow.get_offsets())) == (38, 2)
    assert filled.get_facecolor().shape == (1, 4)
    assert hollow.get_facecolor().shape == (0, 4)


@pytest.mark.parametrize("ratios", [[1.0], [1.0, 1.0], [0.01, 100.0], [0.5, 0.9, 1.2]])
def test_the_histogram_is_symmetric_about_one(ratios: list[float]) -> None:
    low, high = draw_ratio_histogram({OURS: np.array(ratios)}, "optimistic").axes[0].get_xlim()
    assert low == -high
    assert 2.0**high >= max(max(ratios), 1.0 / min(ratios))


def test_curves_are_sorted_and_split(tmp_path):
    path = tmp_path / "curves.parquet"
    columns = {
        "step": [2, 1, 1],
        "split": ["train", "train", "validation"],
        "name": ["loss"] * 3,
        "value": [1.0, 3.0, 2.0],
    }
    write_table(path, pa.table(columns))
    curves = read_curves(path)
    assert {split: points[1].tolist() for split, points in curves["loss"].items()} == {
        "train": [3.0, 1.0], "validation": [2.0],
    }  # fmt: skip
    assert draw_training(curves).axes[0].get_title(loc="left") == "loss"


def test_curves_without_a_column_are_refused(tmp_path):
    write_table(tmp_path / "curves.parquet", pa.table({"step": [1], "name": ["loss"]}))
    with pytest.raises(TableError, match=r"columns \['split', 'value'\] are missing"):
        read_curves(tmp_path / "curves.parquet")


@pytest.mark.parametrize("size", [1, 3, 500])
def test_reliability_of_few_and_many_subgoals(size: int) -> None:
    from dataclasses import asdict

    rng = np.random.default_rng(0)
    chance = rng.random(size)
    assert draw_reliability(asdict(calibrate(chance, rng.random(size) < chance))).axes[0].get_xlim() == (0.0, 1.0)


def test_the_baseline_and_the_first_candidate_always_look_the_same() -> None:
    few = colours_of([("a", "baseline"), ("b", "candidate"), ("c", "bound")])
    many = colours_of([("a", "baseline"), *((f"b{index}", "candidate") for index in range(9)), ("c", "bound")])
    assert (many["a"], many["b0"], many["c"]) == (few["a"], few["b"], few["c"])
    assert len({many["b0"], many["b1"], many["b2"], many["b3"]}) == 4
