import os

import pytest

pytest.importorskip("sklearn")

from sklearn.utils.estimator_checks import parametrize_with_checks

from flexor.sklearn import FlexorRegressor

SEARCHES = [FlexorRegressor()] if os.environ.get("FLEXOR_LONG") else []


@pytest.mark.parametrize("wrong", [{"structure": "nonsense"}, {"rate_hz": -5}])
def test_what_is_no_setting_is_refused(wrong):
    with pytest.raises(ValueError, match="nonsense|rate_hz=-5"):
        FlexorRegressor(**wrong).fit([[1.0], [2.0], [4.0]], [1.0, 2.0, 3.0])


@parametrize_with_checks([FlexorRegressor(structure="line"), *SEARCHES])
def test_scikit_learns_checks(estimator, check):
    check(estimator)
