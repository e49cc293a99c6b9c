"""Missions: in files, and found in a log as transactions."""

from mavframecheck.missions.held import Held, Ledger, Readback
from mavframecheck.missions.items import Items
from mavframecheck.missions.reading import read_mission, uncollected
from mavframecheck.missions.transactions import Mission, Transactions

__all__ = [
    "Held",
    "Items",
    "Ledger",
    "Mission",
    "Readback",
    "Transactions",
    "read_mission",
    "uncollected",
]
