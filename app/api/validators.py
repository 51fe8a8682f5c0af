"""Entity tags (RFC 9110): a client that has a run, a picture or a file already is told so instead of sent it again."""

from __future__ import annotations

import hashlib

from fastapi import Request, Response

NOT_MODIFIED: dict[int | str, dict[str, str]] = {304: {"description": "the client has it: see If-None-Match and ETag"}}
_ON_304 = ("etag", "cache-control", "vary")
_TAG_LENGTH = 32


def with_tag(request: Request, response: Response) -> Response:
    """The response with a strong entity tag, or 304 without content if the client named that tag.

    The tag is a hash of the content: it holds for open runs, which change, as well as for ended ones, which do not.
    """
    tag = f'"{hashlib.sha256(response.body).hexdigest()[:_TAG_LENGTH]}"'
    response.headers["ETag"] = tag
    if not _names(request.headers.get("if-none-match", ""), tag):
        return response
    kept = {name: value for name, value in response.headers.items() if name in _ON_304}
    return Response(status_code=304, headers=kept)


def _names(asked: str, tag: str) -> bool:
    """Whether If-None-Match names the tag, by weak comparison."""
    return asked.strip() == "*" or tag in (each.strip().removeprefix("W/") for each in asked.split(","))
