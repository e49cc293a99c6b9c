"""Missions: found in a log as transactions (files come later)."""

from mavframecheck.missions.items import Items
from mavframecheck.missions.transactions import Mission, Transactions

__all__ = ["Items", "Mission", "Transactions"]
