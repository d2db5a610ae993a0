"""HTTP as RFC 9110 and 9112 have it: bytes in, statuses out. The table is the list of all cases that are checked."""

import email.utils
import hashlib
import json
import os
import re
import socket
import unittest

from daemon import Daemon, shared_data

H = b"Host: a\r\n"
GET = b"GET /livez HTTP/1.1\r\nHost: a\r\n"
SCENE = b'{"objects": []}'
POST = b"POST /v1/scenes HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\n"
CHUNKED = POST + b"Transfer-Encoding: chunked\r\n\r\n"
TAKEN = (200, 201)  # The scene is new the first time.


def post(headers, body=SCENE):
    return POST + headers + b"\r\n" + body


def chunks(*sizes_and_data, end=b"0\r\n\r\n"):
    return CHUNKED + b"".join(sizes_and_data) + end


def whole(size_line=b"f", after=b"\r\n"):
    """The scene as one chunk, with this line before it."""
    return size_line + b"\r\n" + SCENE + after


# Section of the RFC, what is asked, bytes, and the statuses of all answers in order. After the bytes the client sends no
# more, so that what needs more bytes breaks off there.
CASES = [
    # The request line.
    ("9112 3", "a request", GET + b"\r\n", 200),
    ("9112 3", "a path that isn't there", b"GET /nothing HTTP/1.1\r\n" + H + b"\r\n", 404),
    ("9112 2.2", "an empty line before it", b"\r\n" + GET + b"\r\n", 200),
    ("9112 2.2", "two empty lines before it", b"\r\n\r\n" + GET + b"\r\n", 200),
    ("9112 2.2", "empty lines without end", b"\r\n" * 5000 + GET + b"\r\n", 400),
    ("9112 2.2", "an empty line after a body", post(b"Content-Length: 15\r\n") + b"\r\n" + GET + b"\r\n", TAKEN, 200),
    ("9112 2.2", "a bare LF before it", b"\n" + GET + b"\r\n", 400),
    ("9112 2.2", "LF ends lines", b"GET /livez HTTP/1.1\nHost: a\n\n", 400),
    ("9112 2.2", "LF ends the request line", b"GET /livez HTTP/1.1\nHost: a\r\n\r\n", 400),
    ("9112 2.2", "LF ends a header", b"GET /livez HTTP/1.1\r\nHost: a\nX: y\r\n\r\n", 400),
    ("9112 2.2", "CR ends lines", b"GET /livez HTTP/1.1\rHost: a\r\r", 400),
    ("9112 2.2", "a bare CR in the request line", b"GET /livez\r HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9112 2.2", "space before the first header", b"GET /livez HTTP/1.1\r\n X: y\r\n" + H + b"\r\n", 400),
    ("9112 3", "two spaces after the method", b"GET  /livez HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9112 3", "two spaces before the version", b"GET /livez  HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9112 3", "a space at the end", b"GET /livez HTTP/1.1 \r\n" + H + b"\r\n", 400),
    ("9112 3", "a space at the beginning", b" GET /livez HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9112 3", "tabs for spaces", b"GET\t/livez\tHTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9112 3", "no target", b"GET HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9112 3", "no target, two spaces", b"GET  HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9112 3", "nothing but a method", b"GET\r\n" + H + b"\r\n", 400),
    ("9112 3", "HTTP/0.9", b"GET /livez\r\n", 400),
    ("9112 3", "HTTP/0.9, breaking off", b"GET /livez", 400),
    ("9112 3", "nothing at all", b""),
    ("9112 3", "an empty line and nothing else", b"\r\n"),
    ("9112 3", "half a request line", b"GET /li", 400),
    ("9112 3", "half a header", GET + b"X: ", 400),
    ("9112 3", "no last line", GET, 400),
    ("9112 3", "what isn't HTTP", b"\x00\x01\x02\x03\r\n\r\n", 400),
    ("9112 3", "TLS", b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + b"\xaa" * 32, 400),
    ("9112 3", "SSH", b"SSH-2.0-OpenSSH_9.2\r\n", 400),
    # Versions.
    ("9112 2.3", "HTTP/1.0", b"GET /livez HTTP/1.0\r\n\r\n", 200),
    ("9112 2.3", "HTTP/1.0 with a Host", b"GET /livez HTTP/1.0\r\n" + H + b"\r\n", 200),
    ("9110 2.5", "a later 1.x is taken for 1.1", b"GET /livez HTTP/1.2\r\n" + H + b"\r\n", 200),
    ("9110 2.5", "1.9", b"GET /livez HTTP/1.9\r\n" + H + b"\r\n", 200),
    ("9110 2.5", "1.9 needs a Host, too", b"GET /livez HTTP/1.9\r\n\r\n", 400),
    ("9110 15.6.6", "HTTP/2.0", b"GET /livez HTTP/2.0\r\n" + H + b"\r\n", 505),
    ("9110 15.6.6", "HTTP/3.0", b"GET /livez HTTP/3.0\r\n" + H + b"\r\n", 505),
    ("9110 15.6.6", "HTTP/0.9, said", b"GET /livez HTTP/0.9\r\n" + H + b"\r\n", 505),
    ("9110 15.6.6", "HTTP/9.9", b"GET /livez HTTP/9.9\r\n" + H + b"\r\n", 505),
    ("9113 3.4", "the preface of HTTP/2", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 505),
    *[("9112 2.3", f"version {version!r}", b"GET /livez " + version + b"\r\n" + H + b"\r\n", 400)
      for version in (b"http/1.1", b"Http/1.1", b"HTTP/1", b"HTTP/11", b"HTTP/1.11", b"HTTP/1.", b"HTTP/.1", b"HTTP/",
                      b"HTTP 1.1", b"HTTP/a.b", b"HTTP/1.x", b"HTTP/-1.1", b"HTTP/1,1", b"HTTPS/1.1", b"ICE/1.0",
                      b"RTSP/1.0", b"HTTP/01.1", b"HTTP/1.1.1")],
    # Methods.
    *[("9110 9.1", f"method {method!r}", method + b" /livez HTTP/1.1\r\n" + H + b"\r\n", 501)
      for method in (b"get", b"Get", b"GETT", b"GE", b"BREW", b"PROPFIND", b"M-SEARCH", b"LINK", b"PURGE", b"X" * 100,
                     b"!#$%&'*+-.^_`|~09az")],
    ("9110 9.3.6", "CONNECT", b"CONNECT a:443 HTTP/1.1\r\nHost: a:443\r\n\r\n", (400, 501)),
    ("9110 9.3.8", "TRACE is known, and not allowed", b"TRACE /livez HTTP/1.1\r\n" + H + b"\r\n", 405),
    *[("9110 15.5.6", f"{method!r} isn't for this path", method + b" /livez HTTP/1.1\r\n" + H + b"\r\n", 405)
      for method in (b"POST", b"PUT", b"DELETE", b"PATCH")],
    *[("9110 5.6.2", f"{method!r} is no token", method + b" /livez HTTP/1.1\r\n" + H + b"\r\n", 400)
      for method in (b"G[T", b"GET,", b"G(T)", b'"GET"', b"G:T", b"G\xc3\x89T", b"G@T", b"{GET}", b"G/T", b"<GET>")],
    ("9110 9.1", "a method without end", b"G" * 20000, 501),
    ("9110 9.3.2", "HEAD", b"HEAD /livez HTTP/1.1\r\n" + H + b"\r\n", 200),
    ("9110 9.3.2", "HEAD of what isn't there", b"HEAD /nothing HTTP/1.1\r\n" + H + b"\r\n", 404),
    ("9110 9.3.2", "HEAD where GET isn't", b"HEAD /v1/scenes HTTP/1.1\r\n" + H + b"\r\n", 405),
    ("9110 9.3.2", "HEAD that is malformed", b"HEAD /livez HTTP/1.1\r\n\r\n", 400),
    ("9110 9.3.7", "OPTIONS of a path", b"OPTIONS /livez HTTP/1.1\r\n" + H + b"\r\n", 204),
    ("9110 9.3.7", "OPTIONS of the server", b"OPTIONS * HTTP/1.1\r\n" + H + b"\r\n", 204),
    ("9110 9.3.7", "OPTIONS of what isn't there", b"OPTIONS /nothing HTTP/1.1\r\n" + H + b"\r\n", 404),
    ("9112 3.2.4", "* is for OPTIONS alone", b"GET * HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9112 3.2.4", "** is nothing", b"OPTIONS ** HTTP/1.1\r\n" + H + b"\r\n", 400),
    # Targets.
    ("9112 3.2.2", "the absolute form", b"GET http://a/livez HTTP/1.1\r\n" + H + b"\r\n", 200),
    ("9112 3.2.2", "with a port", b"GET http://a:80/livez HTTP/1.1\r\n" + H + b"\r\n", 200),
    ("9112 3.2.2", "with an empty port", b"GET http://a:/livez HTTP/1.1\r\n" + H + b"\r\n", 200),
    ("9112 3.2.2", "with an IPv6 address", b"GET http://[::1]:80/livez HTTP/1.1\r\n" + H + b"\r\n", 200),
    ("9112 3.2.2", "it beats the Host", b"GET http://b/livez HTTP/1.1\r\n" + H + b"\r\n", 200),
    ("9112 3.2.2", "a Host is needed all the same", b"GET http://a/livez HTTP/1.1\r\n\r\n", 400),
    ("9110 4.2.3", "a scheme in capitals", b"GET HTTP://a/livez HTTP/1.1\r\n" + H + b"\r\n", 200),
    ("9110 4.2.3", "a scheme in both", b"GET hTTp://A/livez HTTP/1.1\r\n" + H + b"\r\n", 200),
    ("9112 3.2.2", "no path is /", b"GET http://a HTTP/1.1\r\n" + H + b"\r\n", 404),
    ("9112 3.2.2", "no path, a query", b"GET http://a?x HTTP/1.1\r\n" + H + b"\r\n", 404),
    ("9110 4.2.1", "no host", b"GET http:///livez HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9110 4.2.1", "a port without a host", b"GET http://:80/livez HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9110 4.2.4", "a user in it", b"GET http://u@a/livez HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9110 4.2.4", "a user and a password", b"GET http://u:p@a/livez HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9110 7.4", "another scheme", b"GET https://a/livez HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9110 7.4", "yet another", b"GET ftp://a/livez HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9112 3.2.3", "the authority form", b"GET a:80 HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9112 3.2.1", "no slash", b"GET livez HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9112 3.2.1", "two slashes are another path", b"GET //livez HTTP/1.1\r\n" + H + b"\r\n", 404),
    ("9112 3.2.1", "dots aren't taken away", b"GET /v1/../livez HTTP/1.1\r\n" + H + b"\r\n", 404),
    ("9112 3.2.1", "a query", b"GET /v1/jobs?limit=1 HTTP/1.1\r\n" + H + b"\r\n", 200),
    ("9112 3.2.1", "an empty query", b"GET /livez? HTTP/1.1\r\n" + H + b"\r\n", 200),
    ("9112 3.2", "a fragment", b"GET /livez#a HTTP/1.1\r\n" + H + b"\r\n", 400),
    ("9110 4.2.3", "letters may be encoded", b"GET /%6Civez HTTP/1.1\r\n" + H + b"\r\n", 200),
    ("9110 4.2.3", "in small digits", b"GET /%6civez HTTP/1.1\r\n" + H + b"\r\n", 200),
    ("9110 4.2.3", "but not the slash", b"GET /v1%2Fversion HTTP/1.1\r\n" + H + b"\r\n", 404),
    ("9110 4.2.3", "nor once more", b"GET /%256Civez HTTP/1.1\r\n" + H + b"\r\n", 404),
    ("3986 2.1", "a zero in it", b"GET /livez%00 HTTP/1.1\r\n" + H + b"\r\n", 404),
    ("3986 2.1", "a line end in it", b"GET /livez%0d%0a HTTP/1.1\r\n" + H + b"\r\n", 404),
    ("3986 2.1", "bytes that aren't UTF-8", b"GET /%ff%fe HTTP/1.1\r\n" + H + b"\r\n", 404),
    *[("3986 2.1", f"{target!r} is half encoded", b"GET " + target + b" HTTP/1.1\r\n" + H + b"\r\n", 400)
      for target in (b"/%", b"/%4", b"/%zz", b"/%4g", b"/%%41", b"/livez?%", b"/livez?a=%x1")],
    *[("3986 3.3", f"byte {byte:#04x} in a path", b"GET /a" + bytes([byte]) + b"b HTTP/1.1\r\n" + H + b"\r\n", 400)
      for byte in (*b'"<>\\^`{|}[] \t', 0x00, 0x01, 0x08, 0x0B, 0x0C, 0x1B, 0x7F, 0x80, 0xA0, 0xC3, 0xFF)],
    *[("3986 3.4", f"byte {byte:#04x} in a query", b"GET /livez?a" + bytes([byte]) + b" HTTP/1.1\r\n" + H + b"\r\n", 400)
      for byte in (*b'"<>\\^`{|}[]', 0x00, 0x7F, 0xC3)],
    *[("3986 3.3", f"{byte:#04x} may stand in a path", b"GET /a" + bytes([byte]) + b"b HTTP/1.1\r\n" + H + b"\r\n", 404)
      for byte in b"-._~!$&'()*+,;=:@"],
    ("9112 3", "a target of 8,000 bytes", b"GET /" + b"a" * 8000 + b" HTTP/1.1\r\n" + H + b"\r\n", 404),
    ("9110 15.5.15", "a target of 9,000 bytes", b"GET /" + b"a" * 9000 + b" HTTP/1.1\r\n" + H + b"\r\n", 414),
    ("9110 15.5.15", "a target without end", b"GET /" + b"a" * 200_000, 414),
    ("9110 15.5.15", "a query without end", b"GET /livez?" + b"a" * 200_000, 414),
    # Host.
    ("9112 3.2", "no Host", b"GET /livez HTTP/1.1\r\n\r\n", 400),
    ("9112 3.2", "two Hosts", GET + b"Host: b\r\n\r\n", 400),
    ("9112 3.2", "the same Host twice", GET + H + b"\r\n", 400),
    ("9112 3.2", "two Hosts in HTTP/1.0", b"GET /livez HTTP/1.0\r\nHost: a\r\nHost: b\r\n\r\n", 400),
    ("9112 3.2", "two of them, in other letters", GET + b"HOST: a\r\n\r\n", 400),
    *[("9112 3.2", f"Host: {host!r}", b"GET /livez HTTP/1.1\r\nHost: " + host + b"\r\n\r\n", 200)
      for host in (b"a", b"a.b.c", b"a:80", b"a:", b"127.0.0.1", b"127.0.0.1:8080", b"[::1]", b"[::1]:8080", b"A.B.C",
                   b"a.", b"  a  ", b"localhost", b"LocalHost:9", b"localhost.", b"[0:0:0:0:0:0:0:1]",
                   b"[::ffff:127.0.0.1]")],
    *[("9110 7.4", f"Host: {host!r} isn't this server", b"GET /livez HTTP/1.1\r\nHost: " + host + b"\r\n\r\n", 421)
      for host in (b"", b"xn--nxasmq6b", b"a_b", b"A.B", b"a%20b", b"[2001:db8::7]", b"c", b"evil.example:8080",
                   b"localhost.evil.example", b"127.0.0.1.evil.example", b"a.b.c.d", b"localhosta", b"0.0.0.0",
                   b"8.8.8.8", b"127.0.0.2", b"2130706433", b"[::]")],
    ("9110 7.4", "the absolute form has another host", b"GET http://c/livez HTTP/1.1\r\n" + H + b"\r\n", 421),
    ("9110 7.4", "before a body is read", POST.replace(b"Host: a", b"Host: c") + b"Content-Length: 15\r\n"
     b"Expect: 100-continue\r\n\r\n", 421),
    ("9110 7.4", "HTTP/1.0 with another host", b"GET /livez HTTP/1.0\r\nHost: c\r\n\r\n", 421),
    *[("9112 3.2", f"Host: {host!r}", b"GET /livez HTTP/1.1\r\nHost: " + host + b"\r\n\r\n", 400)
      for host in (b"a b", b"a, b", b"a,b", b"a/b", b"http://a", b"u@a", b"a:b", b"a:80:90", b"a:-1", b"[::1", b"::1",
                   b"[::1]a", b"[a]", b"[]", b"a?b", b"a#b", b"<a>", b"a\tb", b"\xc3\xa4", b"a\\b", b'"a"', b"a b:80")],
    # Headers.
    ("9112 5", "no value", GET + b"X:\r\n\r\n", 200),
    ("9112 5", "no space", GET + b"X:y\r\n\r\n", 200),
    ("9112 5", "much space", GET + b"X: \t y \t \r\n\r\n", 200),
    ("9110 5.5", "tabs and high bytes in a value", GET + b"X: a\tb\xc3\xa4\xff\r\n\r\n", 200),
    ("9110 5.1", "odd but right names", GET + b"!#$%&'*+-.^_`|~09: y\r\n\r\n", 200),
    ("9112 5.1", "space before the colon", GET + b"X : y\r\n\r\n", 400),
    ("9112 5.1", "a tab before the colon", GET + b"X\t: y\r\n\r\n", 400),
    ("9112 5.1", "space in a name", GET + b"X Y: z\r\n\r\n", 400),
    ("9112 5.2", "a line that is continued", GET + b"X: y\r\n z\r\n\r\n", 400),
    ("9112 5.2", "continued with a tab", GET + b"X: y\r\n\tz\r\n\r\n", 400),
    ("9112 5.2", "continued with nothing", GET + b"X: y\r\n \r\n\r\n", 400),
    ("9112 5", "no colon", GET + b"X\r\n\r\n", 400),
    ("9112 5", "no name", GET + b": y\r\n\r\n", 400),
    *[("9110 5.5", f"byte {byte:#04x} in a value", GET + b"X: a" + bytes([byte]) + b"b\r\n\r\n", 400)
      for byte in (0x00, 0x01, 0x07, 0x08, 0x0B, 0x0C, 0x0D, 0x1B, 0x1F, 0x7F)],
    *[("9110 5.1", f"byte {byte:#04x} in a name", GET + b"X" + bytes([byte]) + b"Y: z\r\n\r\n", 400)
      for byte in (0x00, 0x0D, *b'()<>@,;\\"/[]?={}', 0x7F, 0x80, 0xC3)],
    ("6585 5", "a header of 15,000 bytes", GET + b"X: " + b"y" * 15_000 + b"\r\n\r\n", 200),
    ("6585 5", "a header of 20,000 bytes", GET + b"X: " + b"y" * 20_000 + b"\r\n\r\n", 431),
    ("6585 5", "a value without end", GET + b"X: " + b"y" * 200_000, 431),
    ("6585 5", "a name without end", GET + b"X" * 200_000, 431),
    ("6585 5", "90 headers", GET + b"X: y\r\n" * 90 + b"\r\n", 200),
    ("6585 5", "headers without end", GET + b"X: y\r\n" * 20_000, 431),
    ("6585 5", "short headers without end", GET + b"X:\r\n" * 20_000, 431),
    # Lengths.
    ("9112 6.2", "a length", post(b"Content-Length: 15\r\n"), TAKEN),
    ("9112 6.2", "no body where one is due", post(b"", b""), 400),
    ("9112 6.2", "a body of 0 bytes", post(b"Content-Length: 0\r\n", b""), 400),
    ("9112 6.2", "zeros before it", post(b"Content-Length: 0015\r\n"), TAKEN),
    ("9112 6.3", "a body that breaks off", post(b"Content-Length: 16\r\n"), 400),
    *[("9112 6.3", f"Content-Length: {length!r}", post(b"Content-Length: " + length + b"\r\n"), 400)
      for length in (b"", b"-1", b"+15", b"15.0", b"0x0f", b"15 15", b"1 5", b"f", b"15;a", b"15,16", b"a15", b"15a",
                     b"\xc2\xb9\xc2\xb5", b"15,", b'"15"')],
    ("9112 6.3", "different ones", post(b"Content-Length: 15\r\nContent-Length: 16\r\n"), 400),
    ("9112 6.3", "the same one twice", post(b"Content-Length: 15\r\nContent-Length: 15\r\n"), 400),
    ("9112 6.3", "the same one in a list", post(b"Content-Length: 15, 15\r\n"), 400),
    ("9110 15.5.14", "a large one", post(b"Content-Length: 99999999999\r\n"), 413),
    ("9110 8.6", "2^63", post(b"Content-Length: 9223372036854775808\r\n"), 413),
    ("9110 8.6", "2^64", post(b"Content-Length: 18446744073709551616\r\n"), 413),
    ("9110 8.6", "2^64 + 15", post(b"Content-Length: 18446744073709551631\r\n"), 413),
    ("9110 8.6", "1,000 digits", post(b"Content-Length: " + b"9" * 1000 + b"\r\n"), 413),
    ("9110 9.3.1", "a body where none is taken", GET + b"Content-Length: 1\r\n\r\nx", 400),
    ("9110 9.3.1", "a length of 0 is no body", GET + b"Content-Length: 0\r\n\r\n", 200),
    # Transfer codings.
    ("9112 7.1", "chunks", chunks(whole()), TAKEN),
    ("9112 7.1", "small ones", chunks(*(b"1\r\n" + SCENE[i : i + 1] + b"\r\n" for i in range(15))), TAKEN),
    ("9112 7.1", "digits in capitals", chunks(whole(b"F")), TAKEN),
    ("9112 7.1", "zeros before the size", chunks(whole(b"0000f")), TAKEN),
    ("9112 7.1", "zeros for the last", chunks(whole(), end=b"0000\r\n\r\n"), TAKEN),
    ("9112 7.1", "CHUNKED", POST + b"Transfer-Encoding: CHUNKED\r\n\r\n" + whole() + b"0\r\n\r\n", TAKEN),
    ("9112 7.1", "a request after it", chunks(whole()) + GET + b"\r\n", TAKEN, 200),
    ("9112 7.1.1", "an extension", chunks(whole(b"f;a")), TAKEN),
    ("9112 7.1.1", "with a value", chunks(whole(b"f;a=b")), TAKEN),
    ("9112 7.1.1", "with a quoted one", chunks(whole(b'f;a="b;\\"c"')), TAKEN),
    ("9112 7.1.1", "with spaces", chunks(whole(b"f ; a = b")), TAKEN),
    ("9112 7.1.1", "several", chunks(whole(b'f;a;b=c;d="e"')), TAKEN),
    ("9112 7.1.1", "of the last chunk", chunks(whole(), end=b"0;a=b\r\n\r\n"), TAKEN),
    *[("9112 7.1.1", f"no extension: {line!r}", chunks(whole(line)), 400)
      for line in (b"f;", b"f;;", b"f;=", b"f;=a", b"f;a=", b'f;a="', b'f;a="b" c', b"f a", b"f;a b", b'f;"a"', b"f;a\x00",
                   b"f;a\x01b", b"f ", b"f,a")],
    ("9112 7.1.1", "an extension without end", CHUNKED + b"f;a=" + b"b" * 300_000, 413),
    ("9112 7.1.1", "extensions without end", CHUNKED + b"1;a=bbbbbbbbbbbbbbbb\r\nx\r\n" * 10_000, 413),
    ("9112 7.1.1", "one of the last chunk, without end", chunks(whole(), end=b"0;" + b"a" * 300_000), 413),
    ("9112 7.1", "a size without end", CHUNKED + b"0" * 300_000, (400, 413)),
    ("9112 7.1", "a size of 17 digits", chunks(whole(b"0000000000000000f")), 400),
    ("9112 7.1", "a size beyond 2^64", chunks(whole(b"1000000000000000f")), (400, 413)),
    ("9112 7.1", "2^64 - 1", chunks(whole(b"ffffffffffffffff")), (400, 413)),
    *[("9112 7.1", f"no size: {line!r}", chunks(whole(line)), 400)
      for line in (b"", b"x", b"0x0f", b"-f", b"+f", b"\tf", b" f", b"f\x00", b"g", b"f.0")],
    ("9112 7.1", "a chunk longer than it says", chunks(whole(b"e")), 400),
    ("9112 7.1", "a chunk shorter than it says", chunks(b"10\r\n" + SCENE + b"\r\n"), 400),
    ("9112 7.1", "no line end after it", chunks(whole(after=b"")), 400),
    ("9112 7.1", "LF after it", chunks(whole(after=b"\n")), 400),
    ("9112 7.1", "LF after the size", CHUNKED + b"f\n" + SCENE + b"\r\n0\r\n\r\n", 400),
    ("9112 7.1", "CR after the size", CHUNKED + b"f\r" + SCENE + b"\r\n0\r\n\r\n", 400),
    ("9112 7.1", "no last chunk", chunks(whole(), end=b""), 400),
    ("9112 7.1", "half a last chunk", chunks(whole(), end=b"0\r\n"), 400),
    ("9112 7.1.2", "a trailer", chunks(whole(), end=b"0\r\nX: y\r\n\r\n"), TAKEN),
    ("9112 7.1.2", "that would be a length", chunks(whole(), end=b"0\r\nContent-Length: 1\r\n\r\n") + GET + b"\r\n", TAKEN,
     200),
    ("9112 7.1.2", "that is none", chunks(whole(), end=b"0\r\nX y\r\n\r\n"), 400),
    ("9112 7.1.2", "that is continued", chunks(whole(), end=b"0\r\nX: y\r\n z\r\n\r\n"), 400),
    ("9112 7.1.2", "a trailer without end", chunks(whole(), end=b"0\r\nX: " + b"y" * 300_000), 431),
    ("9112 7.1.2", "trailers without end", chunks(whole(), end=b"0\r\n" + b"X: y\r\n" * 50_000), 431),
    ("9112 6.3", "a length beside chunks", POST + b"Content-Length: 15\r\nTransfer-Encoding: chunked\r\n\r\n" + whole(), 400),
    ("9112 6.3", "the other way round", POST + b"Transfer-Encoding: chunked\r\nContent-Length: 15\r\n\r\n" + whole(), 400),
    ("9112 6.1", "chunks in HTTP/1.0", CHUNKED.replace(b"HTTP/1.1", b"HTTP/1.0") + whole() + b"0\r\n\r\n", 400),
    *[("9112 6.3", f"Transfer-Encoding: {coding!r}", POST + b"Transfer-Encoding: " + coding + b"\r\n\r\n" + whole(), 400)
      for coding in (b"", b"gzip", b"identity", b"chunked, gzip", b"chunked, chunked", b"xchunked", b"chunkedx",
                     b"chunked;a=b", b"\x0bchunked", b"chunked, identity", b'"chunked"', b"chun ked")],
    ("9112 6.1", "chunks of something unknown", POST + b"Transfer-Encoding: gzip, chunked\r\n\r\n" + whole(), 501),
    ("9112 6.1", "the same on two lines",
     POST + b"Transfer-Encoding: gzip\r\nTransfer-Encoding: chunked\r\n\r\n" + whole(), 501),
    ("9112 6.1", "chunked twice",
     POST + b"Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n\r\n" + whole(), 400),
    ("9112 6.1", "a space in the name", POST + b"Transfer-Encoding : chunked\r\n\r\n" + whole(), 400),
    ("9112 6.1", "chunks where no body is taken", GET + b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 400),
    # Expectations.
    ("9110 10.1.1", "100-continue", post(b"Content-Length: 15\r\nExpect: 100-continue\r\n"), TAKEN),
    ("9110 10.1.1", "in capitals", post(b"Content-Length: 15\r\nExpect: 100-CONTINUE\r\n"), TAKEN),
    ("9110 10.1.1", "without a body", GET + b"Expect: 100-continue\r\n\r\n", 200),
    ("9110 10.1.1", "something else", post(b"Content-Length: 15\r\nExpect: 200-ok\r\n"), 417),
    ("9110 10.1.1", "both", post(b"Content-Length: 15\r\nExpect: 100-continue, a=b\r\n"), 417),
    ("9110 10.1.1", "a large body is refused without it", POST + b"Content-Length: 99999999999\r\n"
     b"Expect: 100-continue\r\n\r\n", 413),
    # Connections.
    ("9112 9.3", "goes on", GET + b"\r\n" + GET + b"\r\n", 200, 200),
    ("9112 9.3", "ends when asked to", GET + b"Connection: close\r\n\r\n" + GET + b"\r\n", 200),
    ("9112 9.3", "in a list", GET + b"Connection: x, Close ,y\r\n\r\n" + GET + b"\r\n", 200),
    ("9112 9.3", "on a second line", GET + b"Connection: x\r\nConnection: close\r\n\r\n" + GET + b"\r\n", 200),
    ("9112 9.3", "close beats keep-alive", GET + b"Connection: keep-alive, close\r\n\r\n" + GET + b"\r\n", 200),
    ("9112 9.3", "HTTP/1.0 ends", b"GET /livez HTTP/1.0\r\n\r\n" * 2, 200),
    ("9112 9.3", "HTTP/1.0 goes on when asked to", b"GET /livez HTTP/1.0\r\nConnection: Keep-Alive\r\n\r\n" * 2, 200, 200),
    ("9112 9.3.2", "requests in a row", GET + b"\r\n" + POST + b"Content-Length: 15\r\n\r\n" + SCENE + GET + b"\r\n", 200,
     TAKEN, 200),
    ("9112 9.3.2", "a refusal in between", GET + b"\r\nGET /nothing HTTP/1.1\r\n" + H + b"\r\n" + GET + b"\r\n", 200, 404,
     200),
    ("9112 9.3.2", "nothing after what is malformed", GET + b"\r\nGET /livez\r\n\r\n" + GET + b"\r\n", 200, 400),
    ("9112 9.3.2", "nothing after a body that wasn't read", GET + b"Content-Length: 99\r\n\r\n" + GET + b"\r\n", 400),
    ("9112 9.3.2", "100 in a row", (GET + b"\r\n") * 100, *[200] * 100),
    ("9110 7.8", "an upgrade is ignored", GET + b"Connection: Upgrade\r\nUpgrade: websocket\r\n\r\n", 200),
    ("9110 7.8", "to HTTP/2, too", GET + b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\n"
     b"HTTP2-Settings: AAMAAABk\r\n\r\n", 200),
    # Media types.
    ("9110 8.3", "no type", b"POST /v1/scenes HTTP/1.1\r\n" + H + b"Content-Length: 15\r\n\r\n" + SCENE, 415),
    ("9110 8.4", "a coding of the content", post(b"Content-Length: 15\r\nContent-Encoding: gzip\r\n"), 415),
]


def responses(answer, head_at=()):
    """(status, headers, body) of each response in these bytes; interim ones are left out."""
    found = []
    while answer:
        head, separator, answer = answer.partition(b"\r\n\r\n")
        assert separator, head
        status_line, *lines = head.split(b"\r\n")
        version, status, _ = status_line.split(b" ", 2)
        assert version == b"HTTP/1.1", status_line  # 9110 2.5: whatever minor version was asked with.
        status = int(status)
        if status < 200:
            assert not lines, lines
            continue
        headers = dict(line.decode().split(": ", 1) for line in lines)
        size = int(headers.get("Content-Length", 0))
        if len(found) in head_at or status in (204, 304):
            size = 0
        assert len(answer) >= size, (head, answer)
        found.append((status, headers, answer[:size]))
        answer = answer[size:]
    return found


class HttpTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--timeout", "2", "--host-name", "a,b", "--host-name", "a.b.c")
        cls.addClassCleanup(cls.daemon.stop)

    def tearDown(self):
        self.assertEqual(self.daemon.request("GET", "/livez").status, 200, self.daemon.log())

    def exchange(self, *pieces, half_close=True):
        """Sends bytes, and no more; everything that comes back until the daemon closes the connection."""
        with socket.create_connection((self.daemon.host, self.daemon.port), timeout=60) as connection:
            answer = b""
            try:
                for piece in pieces:
                    connection.sendall(piece)
                if half_close:
                    connection.shutdown(socket.SHUT_WR)
            except OSError:  # It has refused, and closed, before it was given all.
                pass
            while piece := connection.recv(65536):
                answer += piece
            return answer

    def test_the_table(self):
        self.assertGreater(len(CASES), 215)
        for section, what, sent, *statuses in CASES:
            with self.subTest(f"{section}: {what}"):
                found = responses(self.exchange(sent), head_at=(0,) if sent.startswith(b"HEAD") else ())
                allowed = [status if isinstance(status, tuple) else (status,) for status in statuses]
                self.assertEqual(len(found), len(allowed), found)
                for (status, headers, body), expected in zip(found, allowed):
                    self.assertIn(status, expected, body)
                    self.check(status, headers, body, sent)

    def check(self, status, headers, body, sent):
        """What holds for every response."""
        sent_at = email.utils.parsedate_to_datetime(headers["Date"])  # 9110 6.6.1
        self.assertEqual(headers["Date"], email.utils.format_datetime(sent_at, usegmt=True))
        if status == 204:
            self.assertNotIn("Content-Length", headers)  # 9110 8.6
            self.assertIn("OPTIONS", headers["Allow"])
            return
        self.assertIn("Content-Length", headers)
        self.assertNotIn("Transfer-Encoding", headers)
        if status == 405:
            self.assertIn("Allow", headers)  # 9110 15.5.6
        if status >= 400:
            self.assertEqual(headers["Content-Type"], "application/problem+json")
        if sent.startswith(b"HEAD"):
            self.assertEqual(body, b"")
            self.assertNotEqual(headers["Content-Length"], "0")
        elif status >= 400:
            self.assertEqual(json.loads(body)["status"], status)

    def test_every_split_gives_the_same(self):
        sent = b"\r\n" + chunks(whole(b"f;a=b"), end=b"0\r\nX: y\r\n\r\n") + GET + b"\r\n"
        for at in range(1, len(sent)):
            with socket.create_connection((self.daemon.host, self.daemon.port), timeout=60) as connection:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                connection.sendall(sent[:at])
                connection.sendall(sent[at:])
                connection.shutdown(socket.SHUT_WR)
                answer = b""
                while piece := connection.recv(65536):
                    answer += piece
            statuses = [status for status, _, _ in responses(answer)]
            self.assertIn(statuses, ([200, 200], [201, 200]), at)

    def test_continue_is_said_to_who_waits_for_it(self):
        head = POST + b"Content-Length: 15\r\nExpect: 100-continue\r\n\r\n"
        with socket.create_connection((self.daemon.host, self.daemon.port), timeout=60) as connection:
            connection.sendall(head)
            self.assertEqual(connection.recv(1000), b"HTTP/1.1 100 Continue\r\n\r\n")
            connection.sendall(SCENE)
            self.assertRegex(connection.recv(1000), rb"^HTTP/1.1 20[01] ")
        with socket.create_connection((self.daemon.host, self.daemon.port), timeout=60) as connection:
            connection.sendall(head.replace(b"HTTP/1.1", b"HTTP/1.0"))  # 9110 10.1.1: it has to be ignored.
            connection.sendall(SCENE)
            answer = b""
            while piece := connection.recv(65536):
                answer += piece
            self.assertRegex(answer, rb"^HTTP/1.1 20[01] ")

    def test_a_connection_says_how_it_goes_on(self):
        for sent, connection in ((GET + b"\r\n", None), (GET + b"Connection: close\r\n\r\n", "close"),
                                 (b"GET /livez HTTP/1.0\r\n\r\n", "close"), (b"GET /livez\r\n\r\n", "close"),
                                 (b"GET /livez HTTP/1.0\r\nConnection: keep-alive\r\n\r\n", "keep-alive")):
            ((_, headers, _),) = responses(self.exchange(sent))
            self.assertEqual(headers.get("Connection"), connection, sent)

    def test_refused_at_once_what_can_never_be_right(self):
        """Without the rest being waited for: the connection isn't closed by the client."""
        for sent, status in ((b"GET /livez HTTP/1.1\n", 400), (b"\x16\x03\x01", 400), (b"GET /livez\r\n", 400),
                             (GET + b"X : y\r\n", 400), (b"PRI * HTTP/2.0\r\n", 505), (GET + b"\x00", 400)):
            found = responses(self.exchange(sent, half_close=False))
            self.assertEqual([each[0] for each in found], [status], sent)

    def test_slow_requests(self):
        """9110 15.5.9: whoever has begun hears why the connection ends; whoever hasn't sees it end."""
        post_head = POST + b"Content-Length: 15\r\n\r\n"
        for sent, statuses in ((b"", []), (b"\r\n", []), (b"G", [408]), (GET, [408]), (post_head + b"{", [408]),
                               (GET + b"\r\n", [200]), (GET + b"\r\nG", [200, 408])):
            found = responses(self.exchange(sent, half_close=False))
            self.assertEqual([each[0] for each in found], statuses, sent)

    def test_allow_lists_what_there_is(self):
        for target, methods in (("/v1/jobs", {"GET", "HEAD", "POST", "OPTIONS"}), ("/livez", {"GET", "HEAD", "OPTIONS"}),
                                ("/v1/jobs/0", {"GET", "HEAD", "DELETE", "OPTIONS"}),
                                ("*", {"GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS"})):
            sent = f"OPTIONS {target} HTTP/1.1\r\nHost: a\r\n\r\n".encode()
            ((status, headers, _),) = responses(self.exchange(sent))
            self.assertEqual((status, set(headers["Allow"].split(", "))), (204, methods), target)

    def test_head_is_get_without_the_body(self):
        for path in ("/livez", "/openapi.json", "/nothing", "/problems/not_found", "/schemas/"):
            get, head = self.daemon.request("GET", path), self.daemon.request("HEAD", path)
            self.assertEqual(head.body, b"")
            self.assertEqual(get.status, head.status)
            for name in ("Content-Length", "Content-Type", "Vary"):
                self.assertEqual(get.headers[name], head.headers[name], path)

    def test_a_body_beyond_the_limit(self):
        with Daemon("--max-body", "1000", "--host-name", "a") as daemon:
            self.daemon, shared = daemon, self.daemon
            try:
                for sent in (post(b"Content-Length: 1001\r\n", b" " * 1001),
                             chunks(b"3e9\r\n" + b" " * 1001 + b"\r\n"), CHUNKED + b"1\r\n \r\n" * 1001):
                    ((status, headers, _),) = responses(self.exchange(sent))
                    self.assertEqual((status, headers["Connection"]), (413, "close"))
                self.assertEqual(responses(self.exchange(post(b"Content-Length: 1000\r\n", SCENE.ljust(1000))))[0][0], 201)
            finally:
                self.daemon = shared

    def test_a_blob_in_chunks(self):
        data = os.urandom(300_000)
        path = b"/v1/blobs/sha256:" + hashlib.sha256(data).hexdigest().encode()
        pieces = (data[i : i + 7777] for i in range(0, len(data), 7777))
        body = b"".join(b"%x;a=b\r\n%b\r\n" % (len(piece), piece) for piece in pieces) + b"0\r\n\r\n"
        sent = b"PUT " + path + b" HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n" + body
        self.assertEqual([each[0] for each in responses(self.exchange(sent))], [201])

    def test_the_corpus_of_llhttp(self):
        """Requests of another parser's tests. Whatever it refuses in its strict mode is refused here; and whatever comes, an
        answer or none, the daemon lives."""
        folder = shared_data("http-corpus", "llhttp-request")
        count = 0
        for name in sorted(os.listdir(folder)):
            with open(os.path.join(folder, name), encoding="utf-8") as file:
                text = file.read()
            for meta, request, log in re.findall(r"<!-- meta=(\{[^\n]*\}) -->\n```http\n(.*?)\n```\n.*?```log\n(.*?)```", text,
                                                 re.DOTALL):
                sent = request.replace("\n", "\r\n").replace("\\r\r\n", "\r\r\n")
                sent = sent.replace("\\r", "\r").replace("\\n", "\n").replace("\\t", "\t").replace("\\f", "\f")
                with self.subTest(f"{name}: {sent[:60]!r}"):
                    found = responses(self.exchange(sent.encode("latin-1", "replace")), (0,) if sent.startswith("HEAD") else ())
                    is_strict = json.loads(meta)["type"] == "request"
                    if is_strict and "error code=" in log and found and "code=22" not in log and "code=21" not in log:
                        self.assertGreaterEqual(found[-1][0], 400)
                    count += 1
        self.assertGreater(count, 100)


if __name__ == "__main__":
    unittest.main()
