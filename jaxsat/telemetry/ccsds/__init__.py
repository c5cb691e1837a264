"""CCSDS messages: attitude (AEM) and orbit (OEM) ephemerides."""
