from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

pytest.importorskip("sklearn")

from sklearn.utils.estimator_checks import parametrize_with_checks

from flexor.sklearn import FlexorRegressor


@pytest.mark.parametrize("wrong", [{"structure": "nonsense"}, {"rate_hz": -5}])
def test_what_is_no_setting_is_refused(wrong):
    with pytest.raises(ValueError, match="nonsense|rate_hz=-5"):
        FlexorRegressor(**wrong).fit([[1.0], [2.0], [4.0]], [1.0, 2.0, 3.0])


def test_readings_out_of_range_are_reported_and_threads_predict_at_once():
    t = np.arange(1200) / 20
    angle = 45 + 40 * np.sin(t + np.sin(0.7 * t))
    readings = 3 * angle[:, None] + 200
    model = FlexorRegressor(structure="hw").fit(readings, angle)
    with pytest.warns(UserWarning, match="5 of 5 angles are held"):
        model.predict(np.full((5, 1), 5000.0))
    model.compensator_.step(readings[:50])  # as another thread is at it
    alone = model.predict(readings)
    assert np.array_equal(model.compensator_.step(readings[50:60])[0][:, 0], alone[50:60])
    with ThreadPoolExecutor(4) as threads:
        assert all(np.array_equal(one, alone) for one in threads.map(model.predict, [readings] * 16))


def test_a_line_in_place_of_a_structure_is_reported():
    with pytest.warns(UserWarning, match="a straight line is fitted in place of structure='auto': "):
        model = FlexorRegressor().fit([[1.0], [2.0], [4.0]], [1.0, 2.0, 4.0])
    assert model.compensator_ is None and model.refusal_ and model.predict([[3.0]]) == pytest.approx(3)


@parametrize_with_checks([FlexorRegressor(structure="line")])
def test_scikit_learns_checks(estimator, check):
    check(estimator)
