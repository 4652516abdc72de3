"""data/openapi.json: it is valid, its examples match its schemas and work as they stand, and the answers of a server are as it tells."""
import json
import os
import shutil
import signal
import subprocess
import urllib.parse

import cluster
import harness
import pytest

HERE = os.path.dirname(os.path.abspath(__file__))
FILE = os.path.join(cluster.SOURCE, "data", "openapi.json")
VALIDATOR = os.path.join(HERE, "node_modules", "@seriousme", "openapi-schema-validator")
METHODS = ("get", "put", "post", "patch", "delete")


def escaped(*keys):
    """A JSON pointer, as the fragment of a URI."""
    return "".join("/" + str(key).replace("~", "~0").replace("/", "~1").replace("{", "%7B").replace("}", "%7D") for key in keys)


class TestOpenApi(cluster.MapFolder):
    @classmethod
    def prepare(cls):
        super().prepare()
        cls.image = cluster.images_of("query_around", cls.folder, 0, 1, 1)[0]
        cls.server = cluster.Server(cls.folder, cls.path("maps"), ["--detector", "none"])
        cls.cleanup.callback(lambda: cls.server.end(signal.SIGKILL))

    def setup_method(self):
        self.api, self.checks, self.asked = harness.read_json(FILE), [], set()

    def resolved(self, *keys):
        """(JSON pointer, value) of what is at these keys; of what it refers to where it is a reference."""
        value = self.api
        for key in keys:
            value = value[key]
        if set(value) == {"$ref"}:
            return self.resolved(*value["$ref"].split("/")[1:])
        return escaped(*keys), value

    def responses(self, path, method):
        """{status: (JSON pointer, response)} of an operation."""
        return {status: self.resolved("paths", path, method, "responses", status) for status in self.api["paths"][path][method]["responses"]}

    def operations(self):
        return [(path, method) for path, item in self.api["paths"].items() for method in METHODS if method in item]

    def check(self, what, schema, value):
        self.checks.append({"what": what, "schema": schema, "value": value})

    def wrong(self):
        """What is wrong by all checks so far, a line each: openapi_check.mjs, run by node, says it."""
        if not (shutil.which("node") and os.path.isdir(VALIDATOR)):
            pytest.skip("there is no node, or no " + VALIDATOR)
        done = subprocess.run(["node", os.path.join(HERE, "openapi_check.mjs"), FILE], input=json.dumps(self.checks), capture_output=True, text=True, timeout=60)
        assert (done.returncode, done.stderr) == (0, "")
        return done.stdout.splitlines()

    def ask(self, method, path, status, body="example", token=cluster.WRITE, content_type="application/json", with_query=False, **parameters):
        """Sends a request: with the examples of parameters and body, unless others are given, and of the query if it is asked for. Its answer must be as
        the description tells. Returns it."""
        operation = self.api["paths"][path][method]
        if body == "example":
            body = operation["requestBody"]["content"][content_type]["example"] if "requestBody" in operation else None
        given = [self.resolved("paths", path, "parameters", i)[1] for i in range(len(self.api["paths"][path].get("parameters", ())))]
        where = path.format(**{**{p["name"]: p["example"] for p in given}, **parameters})
        if with_query:
            where += "?" + urllib.parse.urlencode({p["name"]: p["example"] for p in operation["parameters"]})
        headers = {"Authorization": "Bearer " + token} if body is None else {"Authorization": "Bearer " + token, "Content-Type": content_type}
        answer = self.server.request(method.upper(), where, body if isinstance(body, (bytes, type(None))) else json.dumps(body), headers)
        what = f"{method} {where}: {status}"
        assert answer.status == status, (what, answer.body[:500])
        self.asked.add((path, method, str(status)))
        pointer, response = self.responses(path, method)[str(status)]
        kind = answer.type.partition(";")[0]
        assert kind in response["content"], what
        if kind == "application/json":
            self.check(what, pointer + escaped("content", kind, "schema"), answer.json())
        return answer

    def test_examples_match_their_schemas(self):
        for path, method in self.operations():
            operation = self.api["paths"][path][method]
            contents = {status: response.get("content", {}) for status, (_, response) in self.responses(path, method).items()}
            pointers = {status: pointer for status, (pointer, _) in self.responses(path, method).items()}
            if "requestBody" in operation:
                contents["body"], pointers["body"] = operation["requestBody"]["content"], escaped("paths", path, method, "requestBody")
            for place, content in contents.items():
                if "application/json" in content:
                    self.check(f"{method} {path}: example of {place}", pointers[place] + escaped("content", "application/json", "schema"),
                               content["application/json"]["example"])
        assert len(self.checks) > 40
        assert self.wrong() == []

    def test_what_does_not_match_is_found(self):
        self.check("kind", "/components/schemas/Error", {"error": 1})
        self.check("unknown", "/components/schemas/Error", {"error": "", "more": 1})
        self.check("nowhere", "/components/schemas/None", {})
        self.check("right", "/components/schemas/Error", {"error": ""})
        assert [line.partition(":")[0] for line in self.wrong()] == ["kind", "unknown", "nowhere"]

    def test_the_server_does_as_it_tells(self):
        ask, content = self.ask, harness.read_bytes(self.map)
        one, anchors, anchor = ("/v1/maps/{map}" + rest for rest in ("", "/anchors", "/anchors/{anchor}"))
        localize = "/v1/maps/{map}/localize"
        for path in ("/healthz", "/camera", "/", "/oaslam_odometry.wasm"):
            ask("get", path, 200, token="")
        ask("get", "/models/{name}/{file}", 200)
        assert ask("get", "/openapi.json", 200, token="").body == harness.read_bytes(FILE)
        ask("get", "/models/{name}/{file}", 404, file="none")
        ask("put", one, 201, content, content_type="application/octet-stream", map="copy")
        ask("put", one, 200, content, content_type="application/octet-stream", map="copy")
        ask("put", one, 400, content[:-5000], content_type="application/octet-stream", map="copy")
        assert len(ask("get", "/v1/maps", 200).json()["maps"]) == 2

        assert ask("post", anchors, 201).json()["name"] == "door"
        ask("post", anchors, 409)
        ask("post", anchors, 400, {"model": "flag"})
        ask("post", anchors, 413, b" " * 70000)
        assert ask("patch", anchor, 200).json()["size"] == 0.3
        ask("patch", anchor, 404, anchor="none")
        ask("post", anchors, 201, {"name": "gate", "model": "lamp", "origin": [0, 0, 0], "direction": [0, 0, 1]})
        ask("patch", anchor, 409, {"name": "gate"})
        assert len(ask("get", anchors, 200).json()["anchors"]) == 2
        ask("get", anchors, 200, with_query=True)
        ask("get", one, 200)
        ask("get", one, 404, map="none")

        assert ask("post", localize, 200).json()["results"][0]["found"]
        assert ask("post", localize, 200, self.image, content_type="image/png", with_query=True).json()["results"][0]["found"]
        black = {"camera": {"width": 640, "height": 480, "fx": 525}, "detections": []}
        assert not ask("post", localize, 200, {"images": [black]}).json()["results"][0]["found"]
        ask("post", localize, 400, {"images": [{**black, "prior": None, "detections": None}]})
        assert ask("delete", anchor, 200).json() == {"name": "door"}
        ask("delete", anchor, 404)
        ask("delete", one, 200, map="copy")
        ask("delete", one, 404, map="copy")

        for stream in ("/v1/maps/{map}/track", "/v1/maps/{map}/record"):
            ask("get", stream, 426)
        ask("get", "/metrics", 200)
        for path, method in self.operations():
            for status, token in (("401", ""), ("403", cluster.READ)):
                if status in self.api["paths"][path][method]["responses"]:
                    ask(method, path, int(status), None, token=token)
        assert {(path, method, status) for path, method in self.operations() for status in self.responses(path, method)
                          if status.startswith("2") or status in ("401", "403", "409", "426")} == {a for a in self.asked if a[2] not in ("400", "404", "413")}
        assert self.wrong() == []
