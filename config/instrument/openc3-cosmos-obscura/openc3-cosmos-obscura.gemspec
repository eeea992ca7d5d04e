# encoding: ascii-8bit

Gem::Specification.new do |s|
  s.name = 'openc3-cosmos-obscura'
  s.summary = 'Target of OpenC3 COSMOS for Obscura, a stand-in for a space camera'
  s.authors = ['Obscura maintainers']
  s.platform = Gem::Platform::RUBY
  s.license = 'Apache-2.0'
  s.version = ENV['VERSION'] || '0.2.0'
  s.files = Dir.glob('{targets}/**/*') + %w(plugin.txt)
end
