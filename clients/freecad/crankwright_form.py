"""The model of a request form: fields for the selected alternatives, and the resulting request.

Built from the service's description of a kind and an example; standard library only.
"""

from __future__ import annotations

import copy


class Form:
    """The fields of a kind and mode, initialised from a request.

    ``chosen`` maps every place with alternatives (load, material, bore form) to the selected one; `choose` selects
    another, whose fields are then empty. `keep` stores entered values by field path.
    """

    def __init__(self, fields, request):
        self._fields, self._request = fields, request
        self._typed, self._left = {}, set()
        conditions = (condition for field in fields for condition in _conditions(field))
        self._switches = {path for path, _ in conditions} | {f["path"] for f in fields if f["type"] == "form"}
        self.chosen = {}
        self._settle()

    def _settle(self):
        """Select an alternative wherever one is needed under the current selection."""
        for field in self._fields:
            path = field["path"]
            if self.is_switch(field) and path not in self.chosen and self._applies(field) and field["choices"]:
                self.chosen[path] = self._told(field)

    def _applies(self, field):
        return all(self.chosen.get(path) == choice for path, choice in _conditions(field))

    def _told(self, field):
        """The alternative that the request uses for this field."""
        value, choices = self.value(field["path"]), field["choices"]
        if value is None:
            return field["default"] if field["default"] in choices else choices[0]
        if isinstance(value, str):
            return value if value in choices else choices[0]
        for choice in choices:
            own = [f for f in self._fields if (field["path"], str(choice)) in _conditions(f)]
            paths = {f["path"] for f in own}
            if isinstance(value, dict):
                begin = {path.split("[")[0].split(".")[field["path"].count(".") + 1] for path in paths if "." in path}
                if begin and set(value) <= begin:
                    return choice
            elif field["path"] in paths:
                return choice
        return choices[0]

    def is_switch(self, field):
        """Whether other fields depend on it, so that it must not be empty."""
        path = field["path"]
        return path in self._switches and all(needed != path for needed, _ in _conditions(field))

    def shown(self):
        """The current fields in order; items of lists belong to their list, unselected alternatives are left out."""
        found = []
        for field in self._fields:
            if "[]" not in field["path"] and self._applies(field):
                found.append(field)
        return found

    def value(self, path):
        """The field's value: as entered, from the request, or empty."""
        if path in self._typed:
            return self._typed[path]
        if any(path == left or path.startswith(left + ".") for left in self._left):
            return None
        here = self._request
        for name in path.split("."):
            if not isinstance(here, dict):
                return None
            here = here.get(name)
        return here

    def keep(self, values):
        """Store entered values by path."""
        self._typed.update(values)

    def choose(self, path, choice):
        """Select an alternative; the request's values there are dropped."""
        if self.chosen.get(path) == choice:
            return
        field = next(f for f in self._fields if f["path"] == path)
        holder = path if field["type"] == "form" else path.rpartition(".")[0]
        self._left.add(holder)
        below = holder + "."
        self.chosen = {p: c for p, c in self.chosen.items() if not p.startswith(below)}
        self.chosen[path] = choice
        self._settle()

    def request(self):
        """The resulting request; empty fields are omitted."""
        made = copy.deepcopy(self._request)
        for left in self._left:
            _put(made, left, None)
        for field in self.shown():
            path = field["path"]
            if self.is_switch(field):
                inside = any((path, str(self.chosen[path])) in _conditions(f) for f in self._fields)
                if field["type"] != "form" or not inside:
                    _put(made, path, self.chosen[path])
                continue
            value = self.value(path)
            if not isinstance(value, dict):
                _put(made, path, value)
        return made


def _conditions(field):
    """(path, alternative) of every selection the field depends on."""
    return [tuple(part.split("=", 1)) for part in field["when"].split(", ") if part]


def _put(request, path, value):
    """Set the value at a dotted path, or remove it if it is None."""
    *above, last = path.split(".")
    here = request
    for name in above:
        if not isinstance(here.get(name), dict):
            if value is None:
                return
            here[name] = {}
        here = here[name]
    if value is None:
        here.pop(last, None)
    else:
        here[last] = value
