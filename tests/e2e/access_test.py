"""Who may use the daemon, and for what: a stranger with a browser comes first."""

import unittest

from daemon import Daemon
from documents import SMALL_JOB

PAGE = "https://shop.example"
EVIL = "http://evil.example"


class BrowserTest(unittest.TestCase):
    """A page that is open in a browser on this machine."""

    def test_a_name_of_its_own_leads_nowhere(self):
        with Daemon() as daemon:
            job = daemon.submit(SMALL_JOB)
            for host in ("evil.example", f"evil.example:{daemon.port}", "", "0.0.0.0"):
                for method, path in (("GET", "/v1/jobs"), ("GET", f"/v1/jobs/{job}/image"), ("GET", "/livez"),
                                     ("GET", "/openapi.json"), ("POST", "/v1/jobs"), ("OPTIONS", "/v1/jobs")):
                    reply = daemon.request(method, path, headers={"Host": host})
                    self.assertEqual((reply.status, reply.json()["code"]), (421, "misdirected_request"), (host, path))
                    self.assertNotIn("Access-Control-Allow-Origin", reply.headers)
            for host in ("localhost", "LOCALHOST:1", f"127.0.0.1:{daemon.port}", "[::1]:8080"):
                self.assertEqual(daemon.request("GET", "/v1/jobs", headers={"Host": host}).status, 200, host)

    def test_the_server_has_the_names_that_it_is_given(self):
        environment = {"TESSERA_HOST_NAME": "render.example,other.example"}
        with Daemon(env=environment) as daemon:
            for host, status in (("render.example", 200), ("other.example:443", 200), ("example", 421)):
                self.assertEqual(daemon.request("GET", "/livez", headers={"Host": host}).status, status, host)
        with Daemon("--host-name", "flag.example", env=environment) as daemon:  # A flag wins over the environment.
            for host, status in (("flag.example", 200), ("render.example", 421)):
                self.assertEqual(daemon.request("GET", "/livez", headers={"Host": host}).status, status, host)

    def test_a_page_can_change_nothing(self):
        with Daemon() as daemon:
            job = daemon.submit(SMALL_JOB)
            daemon.wait_ended(job)
            same = {"Origin": daemon.url, "Sec-Fetch-Site": "same-origin"}
            requests = [("POST", "/v1/render", "words", {"Content-Type": "text/plain"}),
                        ("POST", "/v1/jobs", SMALL_JOB, {}), ("DELETE", f"/v1/jobs/{job}", None, {}),
                        ("POST", f"/v1/jobs/{job}/cancel", None, {})]
            for foreign in ({"Origin": EVIL}, {"Origin": "null"}, {"Sec-Fetch-Site": "cross-site"},
                            {"Origin": "http://127.0.0.1:1"}, {"Origin": EVIL, "Sec-Fetch-Site": "same-site"}):
                for method, path, body, headers in requests:
                    reply = daemon.request(method, path, body, {**headers, **foreign})
                    self.assertEqual((reply.status, reply.json()["code"]), (403, "forbidden"), (foreign, path))
                    self.assertNotIn("Access-Control-Allow-Origin", reply.headers)
                reply = daemon.request("GET", "/v1/jobs", headers=foreign)  # What the browser keeps from the page.
                self.assertEqual(reply.status, 200)
                self.assertNotIn("Access-Control-Allow-Origin", reply.headers)
            self.assertEqual(len(daemon.request("GET", "/v1/jobs").json()["jobs"]), 1)
            self.assertEqual(daemon.request("POST", "/v1/jobs", SMALL_JOB, same).status, 201)
            self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{job}", headers=same).status, 204)

    def test_a_page_that_is_named_may(self):
        with Daemon("--cors-origin", PAGE, "--cors-origin", "http://localhost:3000") as daemon:
            asked = {"Access-Control-Request-Method": "DELETE", "Access-Control-Request-Headers": "authorization"}
            reply = daemon.request("OPTIONS", "/v1/jobs/0", headers={"Origin": PAGE, **asked})
            self.assertEqual(reply.status, 204)
            self.assertEqual(reply.headers["Access-Control-Allow-Origin"], PAGE)
            self.assertIn("DELETE", reply.headers["Access-Control-Allow-Methods"].split(", "))
            self.assertEqual(reply.headers["Access-Control-Allow-Headers"], "authorization")
            self.assertIn("Origin", ", ".join(reply.headers.get_all("Vary")))
            reply = daemon.request("POST", "/v1/jobs", SMALL_JOB, {"Origin": PAGE, "Sec-Fetch-Site": "cross-site"})
            self.assertEqual((reply.status, reply.headers["Access-Control-Allow-Origin"]), (201, PAGE))
            self.assertIn("Location", reply.headers["Access-Control-Expose-Headers"])
            refused = daemon.request("GET", "/v1/jobs/0", headers={"Origin": "http://localhost:3000"})
            self.assertEqual(refused.status, 404)  # Which the page can read, too.
            self.assertEqual(refused.headers["Access-Control-Allow-Origin"], "http://localhost:3000")

            for origin in (EVIL, PAGE + ".evil.example", "https://SHOP.example", "http://shop.example", "null"):
                reply = daemon.request("OPTIONS", "/v1/jobs/0", headers={"Origin": origin, **asked})
                for name in ("Access-Control-Allow-Origin", "Access-Control-Allow-Methods"):
                    self.assertNotIn(name, reply.headers, origin)
                self.assertEqual(daemon.request("POST", "/v1/jobs", SMALL_JOB, {"Origin": origin}).status, 403, origin)
            self.assertEqual(daemon.request("GET", "/livez").headers["Vary"], "Origin")

    def test_settings_that_make_no_sense_are_refused(self):
        for flags in (("--host-name", "a/b"), ("--host-name", "a:80"), ("--host-name", ""), ("--cors-origin", "*"),
                      ("--cors-origin", "https://a/"), ("--cors-origin", "null"), ("--cors-origin", "https://A.example")):
            with self.assertRaises(RuntimeError) as raised:
                Daemon(*flags).stop()
            self.assertIn(flags[0], str(raised.exception))


if __name__ == "__main__":
    unittest.main()
