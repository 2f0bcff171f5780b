"""Names that can be looked up, and those that could not."""

import pytest

from mdfconv.errors import MdfconvError
from mdfconv.registry import Registry


def registry():
    things = Registry("thing")
    things.add("one-thing", 1, ("uno",))
    return things


@pytest.mark.parametrize("name", ["one-thing", "One_Thing", " one/thing ", "UNO"])
def test_spelling_does_not_matter(name):
    assert registry()[name] == 1


@pytest.mark.parametrize("name", ["my_thing", "My", " a", "", "all", "a:b", None, 5])
def test_a_name_that_could_not_be_looked_up_is_refused(name):
    things = registry()
    with pytest.raises(MdfconvError, match="cannot name a thing"):
        things.add(name, 2)
    with pytest.raises(MdfconvError, match="cannot name a thing"):
        things.add("two", 2, (name,))
    assert things.names == ["one-thing"]
    with pytest.raises(MdfconvError, match="did you mean one-thing"):
        things["one-thin"]


def test_what_is_taken_is_refused():
    things = registry()
    for words in (("uno",), ("two", ("one-thing",))):
        with pytest.raises(MdfconvError, match="exists already"):
            things.add(words[0], 2, *words[1:])
    with pytest.raises(MdfconvError, match="are a sequence"):
        things.add("two", 2, "abc")


def test_a_word_that_is_no_name_offers_what_it_means():
    things = Registry("thing")
    things.add("one-thing", 1, meant_by={"first-of-all": "one-thing:first"})
    for word in ("first-of-all", "First of_all"):
        with pytest.raises(MdfconvError, match="did you mean one-thing:first"):
            things[word]
