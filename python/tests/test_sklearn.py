import os

import pytest

pytest.importorskip("sklearn")

from sklearn.utils.estimator_checks import parametrize_with_checks

from flexor.sklearn import FlexorRegressor

SEARCHES = [FlexorRegressor()] if os.environ.get("FLEXOR_LONG") else []


@parametrize_with_checks([FlexorRegressor(structure="line"), *SEARCHES])
def test_scikit_learns_checks(estimator, check):
    check(estimator)
