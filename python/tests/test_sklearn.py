import pytest

pytest.importorskip("sklearn")

from sklearn.utils.estimator_checks import parametrize_with_checks

from flexor.sklearn import ORDER_MATTERS, FlexorRegressor


@parametrize_with_checks([FlexorRegressor(structure="line")], expected_failed_checks=lambda _: ORDER_MATTERS)
def test_scikit_learns_checks(estimator, check):
    check(estimator)
