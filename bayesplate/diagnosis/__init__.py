"""From the residual of a fit to the effect that may be behind it, in four rooms that data pass in this order.

shifts      what each effect would do to the frequencies of this board
evidence    how probable the readings are under each hypothesis
decision    the verdict, the model that it asks for, its constants, what to measure next
wording     all of it as one result, in words and tables
"""
