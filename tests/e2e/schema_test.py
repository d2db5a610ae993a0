"""The published JSON Schemas say the same as the parser: both are held to the documents in tests/data/documents.

tests/unit/proto/documents_test.cpp holds the parser to them. Every error of a bad document that expected.json marks
"by_schema" must be found by the schema at the same place; a document without such errors must pass the schema.
"""

import json
import os
import pathlib
import unittest

try:
    import jsonschema
except ImportError:
    jsonschema = None

SOURCE = pathlib.Path(os.environ.get("TESSERA_SOURCE", pathlib.Path(__file__).resolve().parents[2]))
SCHEMAS = SOURCE / "proto/schemas"
DOCUMENTS = SOURCE / "tests/data/documents"


def load(path):
    return json.loads(path.read_text(encoding="utf-8"))


def pointer(path):
    return "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in path)


def parent(text):
    return text.rpartition("/")[0]


def words_of(schema, words):
    """The names of fields and the words of enumerations that a schema knows."""
    if isinstance(schema, dict):
        words.update(schema.get("properties", {}))
        words.update(schema.get("enum", []))
        for value in schema.values():
            words_of(value, words)
    elif isinstance(schema, list):
        for value in schema:
            words_of(value, words)


def words_in(document, words):
    if isinstance(document, dict):
        words.update(document)
        for value in document.values():
            words_in(value, words)
    elif isinstance(document, list):
        for value in document:
            words_in(value, words)
    elif isinstance(document, (str, int)):
        words.add(document)


@unittest.skipIf(jsonschema is None, "SKIPPED: the schemas are unchecked; install Debian's python3-jsonschema")
class SchemaTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        schemas = {kind: load(SCHEMAS / f"{kind}.schema.json") for kind in ("scene", "job")}
        store = {schema["$id"]: schema for schema in schemas.values()}
        cls.schemas = schemas
        cls.validators = {
            kind: jsonschema.Draft202012Validator(
                schema, resolver=jsonschema.RefResolver(schema["$id"], schema, store=store)
            )
            for kind, schema in schemas.items()
        }

    def errors(self, path):
        kind = path.name.partition("_")[0]
        return list(self.validators[kind].iter_errors(load(path)))

    def test_schemas_are_schemas(self):
        for kind, schema in self.schemas.items():
            with self.subTest(kind):
                jsonschema.Draft202012Validator.check_schema(schema)

    def test_good_documents_pass(self):
        paths = sorted((DOCUMENTS / "good").glob("*.json"))
        self.assertTrue(paths)
        for path in paths:
            with self.subTest(path.name):
                self.assertEqual([f"{pointer(e.absolute_path)}: {e.message}" for e in self.errors(path)], [])

    def test_bad_documents_fail_where_the_parser_says(self):
        for name, expected in load(DOCUMENTS / "expected.json").items():
            with self.subTest(name):
                found = {pointer(e.absolute_path) for e in self.errors(DOCUMENTS / "bad" / name)}
                wanted = [e["pointer"] for e in expected if e["by_schema"]]
                if not wanted:
                    self.assertEqual(found, set(), "the table says that the schema accepts it")
                for place in wanted:
                    # A field that may not be there is reported at the object that holds it.
                    self.assertTrue(place in found or parent(place) in found, f"{place!r} not among {sorted(found)}")

    def test_good_documents_use_every_field_and_word(self):
        known, used = set(), set()
        for schema in self.schemas.values():
            words_of(schema, known)
        for path in (DOCUMENTS / "good").glob("*.json"):
            words_in(load(path), used)
        self.assertEqual(known - used, set(), "no good document shows that the parser knows these")


if __name__ == "__main__":
    unittest.main()
