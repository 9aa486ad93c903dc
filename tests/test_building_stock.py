"""The stock of an inventory: its ids, by which it knows the inventory again, and replacement costs."""

import numpy as np
import pytest
from test_inventories import table

import warpdyn as wd

pytestmark = pytest.mark.fast


def test_a_missing_replacement_cost_is_named_where_loss_is_asked_for():
    inventory = table([("W1", 1, 2000), ("C1", 5, 2000)], replacement_cost=[np.nan, 5.0])
    stock = wd.inventories.portfolio(inventory)  # which needs no cost
    with pytest.raises(ValueError, match=r"1 \('b0'\) of 2 buildings have no replacement cost"):
        stock.replacement_values(inventory)
    with pytest.raises(ValueError, match="no column replacement_cost"):
        stock.replacement_values(inventory.drop(columns="replacement_cost"))
    below = inventory.assign(replacement_cost=[2.0, -5.0])
    with pytest.raises(ValueError, match=r"1 \('b1' \(-5\.0\)\) of 2 buildings have a replacement cost below 0"):
        stock.replacement_costs(below)


def test_ids_of_another_type_are_told():
    inventory = table([("W1", 1, 2000), ("C1", 5, 2000)]).assign(id=["15", "16"])
    stock = wd.inventories.portfolio(inventory)
    assert stock.buildings(inventory)["id"].tolist() == stock.id.tolist()
    with pytest.raises(
        ValueError, match=r"ids of the inventory are of type int, such as 15, and .* type str, such as '15'"
    ):
        stock.check(inventory.assign(id=[15, 16]))


def test_the_ids_of_a_stock_stay_as_they_were():
    inventory = table([("W1", 1, 2000), ("C1", 5, 2000), ("W1", 1, 2000)])
    stock = wd.inventories.portfolio(inventory)
    stock.check(inventory.assign(id=inventory["id"].astype(object)))  # the same ids, otherwise held
    inventory.loc[1, "id"] = "other"
    assert stock.id.tolist() == ["b0", "b2", "b1"]
    with pytest.raises(
        ValueError, match=r"another inventory: 1 different id, such as 'other' in row 1, which was 'b1'"
    ):
        stock.check(inventory)
