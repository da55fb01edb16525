import numpy as np
import pytest

pytest.importorskip("sklearn")

from sklearn.utils.estimator_checks import parametrize_with_checks

from flexor.sklearn import FlexorRegressor


@pytest.mark.parametrize("wrong", [{"structure": "nonsense"}, {"rate_hz": -5}])
def test_what_is_no_setting_is_refused(wrong):
    with pytest.raises(ValueError, match="nonsense|rate_hz=-5"):
        FlexorRegressor(**wrong).fit([[1.0], [2.0], [4.0]], [1.0, 2.0, 3.0])


def test_readings_out_of_range_are_reported():
    t = np.arange(1200) / 20
    angle = 45 + 40 * np.sin(t + np.sin(0.7 * t))
    model = FlexorRegressor(structure="line").fit(3 * angle[:, None] + 200, angle)
    with pytest.warns(UserWarning, match="5 of 5 angles are held"):
        model.predict(np.full((5, 1), 5000.0))


@parametrize_with_checks([FlexorRegressor(structure="line")])
def test_scikit_learns_checks(estimator, check):
    check(estimator)
