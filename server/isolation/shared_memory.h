#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/store/file_descriptor.h"

/// Memory that two processes know by a file descriptor (memfd_create(2)). What the system refuses is a
/// std::system_error.
namespace tessera::server {

/// None of it, that can grow and not shrink: whoever maps it needn't fear that others take it away.
FileDescriptor make_shared_memory();

/// The same with `bytes` in it.
FileDescriptor make_shared_memory(std::span<const std::byte> bytes);

/// Nobody can change it any more, from now on and whoever has it. False where somebody has it mapped to write to.
bool freeze(const FileDescriptor& memory);

std::uint64_t size_of(const FileDescriptor& file);

void write_all(int file, std::span<const std::byte> bytes);

/// A part of a file or of shared memory, mapped as long as somebody holds it. `offset` needn't be that of a page.
/// Throws std::bad_alloc where it can't be mapped.
std::shared_ptr<const std::byte[]> map_part(int file, std::uint64_t offset, std::size_t bytes);

/// Shared memory of that size to write to. Throws std::bad_alloc where there isn't so much.
std::shared_ptr<std::byte[]> map_to_write(int memory, std::size_t bytes);

/// A copy of its first bytes. A std::system_error where there aren't so many.
std::vector<std::byte> content_of(const FileDescriptor& memory, std::uint64_t bytes);

}  // namespace tessera::server
