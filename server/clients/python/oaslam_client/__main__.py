"""The command: python3 -m oaslam_client URL COMMAND."""
from __future__ import annotations

import argparse
import json
import os
import sys
from typing import Callable, Dict, List, Optional

from .client import Client
from .errors import ServiceError
from .shapes import Camera, Result


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser(prog="oaslam_client", description="Asks a localization service (oaslam serve).",
                                  epilog="The token, if one is needed, is in the environment: OASLAM_TOKEN.")
    top.add_argument("url", metavar="URL", help="http://HOST:PORT or https://HOST:PORT")
    top.add_argument("--ca-file", metavar="FILE", help="PEM file of the certificates by which that of the server is checked")
    top.add_argument("--fingerprint", metavar="SHA256", help="of the server's certificate, as --tls-self-signed logs it")
    top.add_argument("--insecure", action="store_true", help="any certificate will do")
    top.add_argument("--timeout", type=float, default=60, metavar="SECONDS", help="without any answer (60)")
    top.add_argument("--retries", type=int, default=0, metavar="N", help="how often a busy or missing server is asked again (0)")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    commands.add_parser("maps", help="lists the maps")
    localize = commands.add_parser("localize", help="a line for each image: its name, and position (x y z) and rotation (x y z w) of the camera")
    localize.add_argument("map", metavar="MAP")
    localize.add_argument("images", metavar="IMAGE", nargs="+", help="JPEG or PNG file")
    localize.add_argument("--camera", default="auto", metavar="CAMERA", help="auto, fov:DEGREES, or a JSON file with the intrinsics")
    localize.add_argument("--mode", choices=("points", "objects", "points+objects"), default="points+objects", help="what may find an image")
    localize.add_argument("--json", action="store_true", help="all that the service tells, as a line of JSON for each image")
    upload = commands.add_parser("upload", help="stores a map file, in place of the map of that name")
    upload.add_argument("map", metavar="MAP")
    upload.add_argument("file", metavar="FILE")
    delete = commands.add_parser("delete", help="removes a map with its anchors")
    delete.add_argument("map", metavar="MAP")
    anchors = commands.add_parser("anchors", help="a line for each anchor of a map: its name, model, position and rotation")
    anchors.add_argument("map", metavar="MAP")
    return top


def list_maps(client: Client, options: argparse.Namespace) -> None:
    for stored in client.maps():
        print(stored["name"], stored["bytes"], "bytes")


def localize(client: Client, options: argparse.Namespace) -> None:
    camera = camera_of(options.camera)
    for path in options.images:
        result = client.localize(options.map, [path], options.mode, camera=camera)["results"][0]
        if options.json:
            print(json.dumps({"image": path, **result}), flush=True)
        else:
            print(f"{path}:", text_of(result), flush=True)


def text_of(result: Result) -> str:
    if not result["found"]:
        return f"not found: {result['why_not']}"
    return f"{numbers(result['pose']['position'] + result['pose']['rotation'])} by {result['evidence']}, confidence {result['confidence']:.2f}"


def numbers(values: List[float]) -> str:
    return " ".join(f"{value:.6f}" for value in values)


def camera_of(text: str) -> Camera:
    if text == "auto" or text.startswith("fov:"):
        return text
    with open(text, encoding="utf-8") as file:
        try:
            camera: Camera = json.load(file)
        except ValueError as error:
            raise ValueError(f"{text}: no JSON: {error}") from None
    return camera


def upload(client: Client, options: argparse.Namespace) -> None:
    stored = client.upload_map(options.map, options.file)
    print(stored["name"], stored["bytes"], "bytes")


def delete(client: Client, options: argparse.Namespace) -> None:
    client.delete_map(options.map)


def list_anchors(client: Client, options: argparse.Namespace) -> None:
    for anchor in client.anchors(options.map)["anchors"]:
        print(f"{anchor['name']}: {anchor['model']} {numbers(anchor['pose']['position'] + anchor['pose']['rotation'])}")


COMMANDS: Dict[str, Callable[[Client, argparse.Namespace], None]] = {"maps": list_maps, "localize": localize, "upload": upload, "delete": delete,
                                                                     "anchors": list_anchors}


def main(arguments: Optional[List[str]] = None) -> int:
    """Returns the exit status: 1 for a problem, which is one line on the standard error output."""
    options = parser().parse_args(arguments)
    try:
        with Client(options.url, os.environ.get("OASLAM_TOKEN"), ca_file=options.ca_file, fingerprint=options.fingerprint, insecure=options.insecure,
                    timeout=options.timeout, retries=options.retries) as client:
            COMMANDS[options.command](client, options)
    except (ServiceError, OSError, ValueError) as error:
        print(f"oaslam_client: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
