"""Certificates for tests, made by the openssl command."""

import os
import ssl
import subprocess

KEY = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes"]
LOOPBACK = "DNS:localhost,IP:127.0.0.1"


def openssl(*arguments):
    subprocess.run(["openssl", *arguments], capture_output=True, check=True)


class Certificate:
    """A certificate and its key, as PEM files."""

    def __init__(self, folder, name):
        self.path, self.key = os.path.join(folder, f"{name}.pem"), os.path.join(folder, f"{name}.key")

    @property
    def flags(self):
        return ["--tls-certificate", self.path, "--tls-key", self.key]

    def replace_by(self, other):
        """The other's files under these names, each at once."""
        for mine, theirs in ((self.path, other.path), (self.key, other.key)):
            with open(theirs, "rb") as file, open(mine + ".new", "wb") as new:
                new.write(file.read())
            os.chmod(mine + ".new", 0o600)
            os.rename(mine + ".new", mine)


class Authority(Certificate):
    """Who vouches for certificates, and whom a client has to trust."""

    def __init__(self, folder, name="authority"):
        super().__init__(folder, name)
        self.folder = folder
        openssl("req", "-x509", *KEY, "-days", "60", "-subj", f"/CN={name}", "-keyout", self.key, "-out", self.path)

    def issue(self, name, days=30, names=LOOPBACK):
        """A server's certificate; with a negative number of days it has expired."""
        made = Certificate(self.folder, name)
        request, extensions = os.path.join(self.folder, f"{name}.csr"), os.path.join(self.folder, f"{name}.ext")
        with open(extensions, "w", encoding="ascii") as file:
            file.write(f"subjectAltName={names}\nbasicConstraints=critical,CA:false\n")
        openssl("req", *KEY, "-subj", f"/CN={name}", "-keyout", made.key, "-out", request)
        openssl("x509", "-req", "-in", request, "-CA", self.path, "-CAkey", self.key, "-days", str(days), "-extfile",
                extensions, "-out", made.path)
        return made

    def context(self):
        """For a client that trusts this authority alone."""
        return ssl.create_default_context(cafile=self.path)
