"""Missions: in files, and found in a log as transactions."""

from mavframecheck.missions.items import Items
from mavframecheck.missions.reading import read_mission
from mavframecheck.missions.transactions import Mission, Transactions

__all__ = ["Items", "Mission", "Transactions", "read_mission"]
