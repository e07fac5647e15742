# What mypy needs to know of scikit-learn, which has no types: the classes that skidyn derives from
# and the decorator of their `fit`. Everything else stays Any.
