"""From a component to C: its equations traced with CasADi, and the tables that the runtime reads.

Nothing is imported here: CasADi is an extra, and slow to import.
"""
