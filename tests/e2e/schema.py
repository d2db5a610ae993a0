"""As much of JSON Schema as proto/openapi.json uses."""

import re

TYPES = {
    "object": lambda v: isinstance(v, dict),
    "array": lambda v: isinstance(v, list),
    "string": lambda v: isinstance(v, str),
    "integer": lambda v: isinstance(v, int) and not isinstance(v, bool),
    "number": lambda v: isinstance(v, (int, float)) and not isinstance(v, bool),
    "boolean": lambda v: isinstance(v, bool),
    "null": lambda v: v is None,
}
ANNOTATIONS = {"description", "default", "format"}
CHECKS = {"type", "properties", "required", "additionalProperties", "items", "enum", "const", "pattern", "minimum",
          "maximum", "minItems", "maxItems"}


def resolve(document, node):
    """Follows `$ref` inside the document."""
    while "$ref" in node:
        reference = node["$ref"]
        assert reference.startswith("#/"), f"{reference} leads out of the document"
        node = document
        for key in reference[2:].split("/"):
            node = node[key]
    return node


def faults(document, schema, value, where=""):
    """What is wrong with a value, a line for each; a keyword that isn't known here is wrong too."""
    schema = resolve(document, schema)
    unknown = set(schema) - ANNOTATIONS - CHECKS
    if unknown:
        return [f"{where}: the schema uses {unknown}, which this test doesn't know"]
    types = schema.get("type", [])
    types = [types] if isinstance(types, str) else types
    if types and not any(TYPES[name](value) for name in types):
        return [f"{where}: {value!r} is no {types}"]
    found = []
    if "enum" in schema and value not in schema["enum"]:
        found.append(f"{where}: {value!r} is none of {schema['enum']}")
    if "const" in schema and value != schema["const"]:
        found.append(f"{where}: {value!r} isn't {schema['const']!r}")
    if "pattern" in schema and not re.search(schema["pattern"], value):
        found.append(f"{where}: {value!r} doesn't match {schema['pattern']}")
    if "minimum" in schema and value < schema["minimum"]:
        found.append(f"{where}: {value!r} is less than {schema['minimum']}")
    if "maximum" in schema and value > schema["maximum"]:
        found.append(f"{where}: {value!r} is greater than {schema['maximum']}")
    if isinstance(value, list) and not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
        found.append(f"{where}: {len(value)} items")
    if isinstance(value, dict) and "properties" in schema:
        properties = schema["properties"]
        found += [f"{where}/{name}: missing" for name in schema.get("required", []) if name not in value]
        if schema.get("additionalProperties") is False:
            found += [f"{where}/{name}: not in the schema" for name in value if name not in properties]
        for name in properties.keys() & value.keys():
            found += faults(document, properties[name], value[name], f"{where}/{name}")
    if isinstance(value, list) and "items" in schema:
        for i, item in enumerate(value):
            found += faults(document, schema["items"], item, f"{where}/{i}")
    return found
