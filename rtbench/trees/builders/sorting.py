"""Sorting and selecting in compiled code, in the caller's own scratch: np.sort would allocate."""

import numpy as np

RUN = np.int64(12)  # so few numbers are sorted by insertion

CONSTANTS = {"RUN": "int64(12)"}


def sort_runs(numbers, begin, count):
    """Sort ``numbers[begin:begin + count]`` in runs of RUN, by insertion."""
    end = begin + count
    for first in range(begin, end, RUN):
        last = min(first + RUN, end)
        for i in range(first + 1, last):
            number = numbers[i]
            j = i - 1
            while j >= first and numbers[j] > number:
                numbers[j + 1] = numbers[j]
                j -= 1
            numbers[j + 1] = number


def merge(numbers, begin, middle, end, to):
    """Merge two sorted ranges that follow each other into ``numbers[to:]``."""
    i, j = begin, middle
    while i < middle and j < end:
        a, b = numbers[i], numbers[j]
        second = b < a  # arithmetic from here on, for no branch could foresee it
        numbers[to] = b if second else a
        j += np.int64(second)
        i += np.int64(1) - np.int64(second)
        to += 1
    while i < middle:
        numbers[to] = numbers[i]
        to += 1
        i += 1
    while j < end:
        numbers[to] = numbers[j]
        to += 1
        j += 1


def sort_numbers(numbers, begin, count, spare):
    """Sort ``numbers[begin:begin + count]``, by merging; as many from ``spare`` on are overwritten.

    O(n log n) comparisons whatever the order.
    """
    sort_runs(numbers, begin, count)
    source, target, length = begin, spare, RUN
    while length < count:
        for first in range(0, count, 2 * length):
            middle = min(first + length, count)
            end = min(first + 2 * length, count)
            merge(numbers, source + first, source + middle, source + end, target + first)
        source, target, length = target, source, 2 * length
    if source != begin:
        for i in range(count):
            numbers[begin + i] = numbers[spare + i]


def lower_median(numbers, count):
    """Return the lower median of ``numbers[:count]``, whose order is lost; count is at least 1.

    Source: Hoare 1961, algorithm 65 (Find), the pivot the median of three
    """
    wanted = (count - 1) // 2
    left, right = 0, count - 1
    while left < right:
        middle = (left + right) // 2
        if numbers[middle] < numbers[left]:
            numbers[middle], numbers[left] = numbers[left], numbers[middle]
        if numbers[right] < numbers[left]:
            numbers[right], numbers[left] = numbers[left], numbers[right]
        if numbers[right] < numbers[middle]:
            numbers[right], numbers[middle] = numbers[middle], numbers[right]
        pivot = numbers[middle]
        i, j = left, right
        while i <= j:
            while numbers[i] < pivot:
                i += 1
            while pivot < numbers[j]:
                j -= 1
            if i <= j:
                numbers[i], numbers[j] = numbers[j], numbers[i]
                i += 1
                j -= 1
        if j < wanted:
            left = i
        if wanted < i:
            right = j
    return numbers[wanted]


CALLEES = (sort_runs, merge, sort_numbers, lower_median)
