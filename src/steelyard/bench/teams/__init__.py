"""What `bench team` asks beside its cases: bound, intervals, events, laws, troubles; and its table."""
