"""Designs and checks of a Crankwright service from Python.

>>> from crankwright_client import Client
>>> with Client("http://127.0.0.1:8000") as client:
...     run = client.design("flexible-rod", spec)
...     print(run.verdict["summary"], run.result["mass_g"])
"""

from crankwright_client.client import AsyncClient, Client
from crankwright_client.errors import NoAnswer, Problem, RunFailed
from crankwright_client.retries import Retries
from crankwright_client.run import Run

__all__ = ["AsyncClient", "Client", "NoAnswer", "Problem", "Retries", "Run", "RunFailed"]
