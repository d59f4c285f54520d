"""NOTICE and the SBOM of the packages, both made from components.toml."""

import json
import re
import subprocess
import tomllib
from datetime import datetime, timezone
from pathlib import Path
from uuid import NAMESPACE_URL, uuid5

from cyclonedx.factory.license import LicenseFactory
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output.json import JsonV1Dot6
from packageurl import PackageURL

ROOT = Path(__file__).resolve().parent.parent.parent


def version_of(component):
    """The version of a component: as pinned in its file, else that of the installed Debian package."""
    package = component["package"]
    name = PackageURL.from_string(package)
    if "version_in" in component:
        text = (ROOT / component["version_in"]).read_text(encoding="utf-8")
        found = re.search(rf'^{name.name}==([\w.]+)|"@?[\w/]*\b{name.name}": "([\w.]+)"', text,
                          re.MULTILINE | re.IGNORECASE)
        return found[1] or found[2]
    if name.type != "deb":
        return None
    return subprocess.run(["dpkg-query", "-W", "-f", "${Version}\n", name.name], check=True,
                          encoding="utf-8", stdout=subprocess.PIPE).stdout.split()[0]


def licence_text(component):
    """The text of the licence of a component; None for Apache-2.0, which the file LICENSE has."""
    if "text" in component:
        paths = sorted(ROOT.glob(component["text"]))
        if not paths:
            raise FileNotFoundError(f"{component['text']}: expected the licence of "
                                    f"{component['name']}, found no file")
        return paths[0].read_text(encoding="utf-8")
    name = PackageURL.from_string(component["package"])
    if name.type == "deb":
        return Path(f"/usr/share/doc/{name.name}/copyright").read_text(encoding="utf-8")
    return None


def components(system):
    """The components of the packages for `system`: linux or windows, where our programs bring all libraries."""
    listed = tomllib.loads((Path(__file__).parent / "components.toml").read_text(
        encoding="utf-8"))["component"]
    own = [component for component in listed if component.get("system", system) == system]
    if system == "windows":
        own = [component | {"part": re.sub(r"lib/upswing/\S+( \(.*\))?", "the programs", component["part"])}
               for component in own]
    return own


def notice(system):
    """The text of NOTICE."""
    parts = ["Upswing\nCopyright The Upswing developers. Apache License 2.0, see LICENSE.\n\n"
             "The packages of Upswing contain these third-party works:\n"]
    for component in components(system):
        version = version_of(component)
        head = " ".join(filter(None, [component["name"], version]))
        text = licence_text(component) or "The file LICENSE has the text of the Apache License 2.0.\n"
        parts.append(f"{'=' * 80}\n{head}\nLicence: {component['licence']}\n"
                     f"Part: {component['part']}\n\n{text.strip()}\n")
    return "\n".join(parts)


def sbom(version, epoch, system):
    """The software bill of materials, CycloneDX 1.6 in JSON. `epoch`: its time, in seconds."""
    licences = LicenseFactory()
    bom = Bom(serial_number=uuid5(NAMESPACE_URL, f"upswing-{version}-{epoch}"))
    bom.metadata.timestamp = datetime.fromtimestamp(epoch, timezone.utc)
    program = Component(name="upswing", version=version, type=ComponentType.APPLICATION,
                        bom_ref="upswing", licenses=[licences.make_from_string("Apache-2.0")])
    bom.metadata.component = program
    for component in components(system):
        url = PackageURL.from_string(component["package"])
        # fonts have no version
        url = PackageURL(url.type, url.namespace, url.name, version_of(component))
        entry = Component(name=component["name"], version=url.version, purl=url,
                          bom_ref=str(url), description=component["part"],
                          licenses=[licences.make_from_string(component["licence"])])
        bom.components.add(entry)
        bom.register_dependency(program, [entry])
    # Sorts the keys.
    return json.dumps(json.loads(JsonV1Dot6(bom).output_as_string()), indent=2, sort_keys=True) + "\n"
