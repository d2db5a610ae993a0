"""Names of the standard library, and the headers that bring them: those that headers of this project use."""

_BY_HEADER = {
    "algorithm": "clamp sort stable_sort min max minmax find_if find count_if any_of all_of none_of fill fill_n copy_n "
    "nth_element partition lower_bound upper_bound equal transform reverse shuffle rotate",
    "array": "array",
    "atomic": "atomic atomic_flag memory_order_relaxed memory_order_acquire memory_order_release",
    "bit": "bit_cast countr_zero countl_zero popcount bit_width bit_ceil has_single_bit endian rotl",
    "charconv": "from_chars to_chars from_chars_result",
    "chrono": "chrono",
    "cmath": "sqrt isfinite isnan isinf copysign hypot ldexp frexp nextafter fma",
    "concepts": "integral floating_point same_as convertible_to invocable derived_from",
    "condition_variable": "condition_variable condition_variable_any",
    "cstdint": "int8_t int16_t int32_t int64_t uint8_t uint16_t uint32_t uint64_t uintptr_t uintmax_t intmax_t",
    "cstdio": "FILE fprintf printf snprintf fputs fwrite",
    "cstring": "memcpy memmove memset memcmp strlen strerror",
    "deque": "deque",
    "exception": "exception_ptr current_exception rethrow_exception",
    "filesystem": "filesystem",
    "fstream": "ifstream ofstream",
    "functional": "function invoke hash less greater plus",
    "future": "future promise async",
    "iostream": "cout cerr cin",
    "iterator": "istreambuf_iterator back_inserter",
    "latch": "latch",
    "limits": "numeric_limits",
    "list": "list",
    "map": "map multimap",
    "memory": "unique_ptr shared_ptr weak_ptr make_unique make_shared enable_shared_from_this make_unique_for_overwrite",
    "mutex": "mutex lock_guard unique_lock scoped_lock call_once once_flag recursive_mutex",
    "new": "bad_alloc align_val_t",
    "numbers": "numbers",
    "numeric": "iota accumulate",
    "optional": "optional nullopt",
    "random": "random_device mt19937 mt19937_64",
    "semaphore": "counting_semaphore binary_semaphore",
    "set": "set multiset",
    "span": "span as_bytes dynamic_extent",
    "sstream": "ostringstream istringstream stringstream",
    "stdexcept": "runtime_error logic_error invalid_argument out_of_range",
    "stop_token": "stop_token stop_source stop_callback",
    "string": "string to_string stoi stod getline",
    "string_view": "string_view",
    "system_error": "error_code system_error errc generic_category",
    "thread": "thread jthread this_thread",
    "tuple": "tuple tie make_tuple ignore",
    "type_traits": "is_same_v decay_t conditional_t enable_if_t remove_cvref_t is_trivially_copyable_v invoke_result_t",
    "unordered_map": "unordered_map",
    "unordered_set": "unordered_set",
    "utility": "move forward pair exchange swap make_pair",
    "variant": "variant visit get_if holds_alternative monostate",
    "vector": "vector",
}

# What more than one header promises to bring (cppreference.com).
_ALSO = {
    "pair": "map unordered_map",
    "move": "algorithm memory vector string map optional variant functional tuple",
    "forward": "memory functional optional variant tuple",
    "swap": "algorithm memory vector string",
    "exchange": "utility",
    "hash": "string string_view optional variant memory",
    "string_view": "string",
    "abs": "cmath cstdlib",
    "stop_token": "thread condition_variable",
    "stop_source": "thread condition_variable",
    "errc": "charconv",
    "as_bytes": "span",
    "initializer_list": "initializer_list vector string map set utility span",
    "size_t": "cstddef cstdio cstdlib cstring vector string array span memory",
    "ptrdiff_t": "cstddef vector string span",
    "byte": "cstddef span",
}


def headers_of(name):
    """The headers any of which brings std::name; an empty set for names that aren't listed here."""
    known = {header for header, names in _BY_HEADER.items() if name in names.split()}
    return known | set(_ALSO.get(name, "").split())
